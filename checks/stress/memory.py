"""Runs emitted C under sanitizers and valgrind at extreme states."""

import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import serpentail as st
from checks.stress import drops
from checks.stress.bodies import changes
from checks.stress.poses import FAST, SMALL, folds
from checks.stress.subjects import Subject
from serpentail.model.parameters import flat, resolve

DRIVER = Path(__file__).parent / "driver.c"
# how each tool's programs are compiled
SANITIZED = (
    *("gcc", "-O0"),
    *("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"),
)
FOLLOWED = ("clang", "-O1", "-fsanitize=memory", "-fno-sanitize-recover=all")
PLAIN = ("gcc", "-O1")
WATCHED = ("valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full")
WATCHED += ("--errors-for-leak-kinds=definite",)
BARE, BATCH, ROWS = 0, 1, 2  # forms of a function: one state, a batch, a batch in lanes
NUMBERS = (np.nan, np.inf, -np.inf, 1e308, -1e300, 1e155, 1e80, 1e20)
NUMBERS += (3e9, 1e5, 1e-200, 5e-324, -0.0, 0.0)
STATUSES = {0, 1, 2, 3}
ENDS = STATUSES | {33, 34, 38}  # and statuses of runs: steps too small, too many, too long


@dataclass(frozen=True)
class Case:
    """One call of the driver: a function and form, or a rollout method; its record of inputs; and
    whether it must be refused.
    """

    name: str
    record: bytes
    form: int
    refused: bool = False


@dataclass(frozen=True)
class Answer:
    """The driver's answer to a case."""

    status: int
    finite: bool


def driver(model: st.Model) -> str:
    """Return the driver's text for a model."""
    work, many = model.manifest["work"], model.manifest["batch"]["work"]
    bare, rows, entries = [], [], []
    for name, lengths, inputs in shapes(model):
        pointers = ", ".join(f"x[{k}]" for k in range(len(lengths)))
        bare.append(
            f"static int bare_{name}(const @_parameters *p, real **x, real "
            f"*work)\n{{\n  (void)work;\n"
            f"  return @_{name}(p, {pointers}, work);\n}}\n"
        )
        batch = f"@_side_by_side_{name}" if name in many else "NULL"
        entries.append(
            f"  {{ bare_{name}, @_batch_{name}, {batch}, {inputs}, "
            f"{len(lengths) - inputs}, {work[name]}, {many.get(name, 0)}, "
            f"{{ {', '.join(map(str, lengths))} }} }},"
        )
    rows += [f"int @_side_by_side_{name}(@_call *call);" for name in many]
    text = DRIVER.read_text()
    for mark, lines in (("//bare", bare), ("//rows", rows), ("//entries", entries)):
        text = text.replace(f"\n{mark}\n", "\n" + "\n".join(lines) + "\n")
    text = text.replace('#include "@_host.c"', '#include "@_host.c"\n\n#define real @_real')
    return text.replace("@@", model.name.upper()).replace("@", model.name)


def shapes(model: st.Model) -> Iterator[tuple[str, list[int], int]]:
    """Yield functions: name, lengths of inputs and outputs, how many inputs."""
    for name, entry in model.manifest["functions"].items():
        lengths = [int(np.prod(a["shape"])) for a in (*entry["inputs"], *entry["outputs"])]
        yield name, lengths, len(entry["inputs"])


def built(model: st.Model, folder: Path, *compiler: str) -> Path:
    """Compile a model and its driver by a compiler with flags; return the program."""
    main, program = folder / "main.c", folder / "main"
    main.write_text(driver(model))
    sources = [
        path
        for path in sorted((model.folder / "src").glob("*.c"))
        if not path.stem.endswith("_host")
    ]
    places = ("-I", model.folder / "include", "-I", model.folder / "src")
    command = [*compiler, "-std=c99", "-g", *places, main, *sources, "-o", program, "-lm"]
    subprocess.run(list(map(str, command)), check=True)
    return program


def answers(program: Path, found: list[Case], *under: str) -> tuple[list[Answer], str]:
    """Run a program on cases, under a tool or by itself; return what it answered, and the tool's
    report.
    """
    given = b"".join(case.record for case in found)
    done = subprocess.run([*under, str(program)], input=given, capture_output=True, check=False)
    rows = [line.split() for line in done.stdout.decode().splitlines()]
    report = done.stderr.decode()
    return [Answer(int(a), b == "1") for a, b in rows], report or (
        f"exit {done.returncode}" if done.returncode else ""
    )


def insane(found: list[Case], told: list[Answer]) -> list[str]:
    """Return wrong answers: an unknown status, a missing refusal, outputs that are not finite."""
    wrong = [] if len(found) == len(told) else [f"{len(told)} answers to {len(found)} cases"]
    for case, answer in zip(found, told, strict=False):
        known = answer.status in (ENDS if case.name.startswith("rollout") else STATUSES)
        refused = not case.refused or answer.status != 0
        if not (known and refused and (answer.finite or answer.status)):
            wrong.append(f"{case.name}, form {case.form}: {answer}")
    return wrong


def every(model: st.Model, seed: int) -> list[Case]:
    """Return all cases: every function in every form at every state, then runs by every method."""
    rng, vector = np.random.default_rng(seed), model.parameter_vector
    many, found = model.manifest["batch"]["work"], []
    several = (
        model.manifest["batch"]["states"] + 3
    )  # more states than lanes, and no multiple of the lanes
    for number, (name, lengths, inputs) in enumerate(shapes(model)):
        names = [a["name"] for a in model.manifest["functions"][name]["inputs"]]
        for given, parameters, refused in states(model, names, lengths[:inputs], rng):
            for form in (BARE, BATCH, *([ROWS] if name in many else [])):
                count = several if form == ROWS else 1
                arrays = [np.broadcast_to(x, (count, len(x))) for x in given]
                found.append(
                    Case(
                        name,
                        packed(model, 3 * number + form, count, 0, parameters, arrays),
                        form,
                        refused,
                    )
                )
    return [*found, *runs(model, rng, 3 * (number + 1), vector)]


def packed(model: st.Model, which: int, count: int, method: int, parameters, arrays) -> bytes:
    """Return a record of the driver."""
    numbers = [parameters, *arrays]
    with np.errstate(over="ignore", under="ignore"):
        body = b"".join(
            np.ascontiguousarray(x, model.parameter_vector.dtype).tobytes() for x in numbers
        )
    return np.array([which, count, method], np.intc).tobytes() + body


def states(
    model: st.Model, names: list[str], lengths: list[int], rng
) -> Iterator[tuple[list, np.ndarray, bool]]:
    """Yield inputs, parameters, and whether they must be refused: poses, speeds, extremes, then a
    number anywhere.
    """
    vector, nt = model.parameter_vector, model.nv - 6
    poses = folds(Subject("", model, None))
    poses |= {f"bend {bend:g}": np.full(nt, bend / np.sqrt(2)) for bend in (*SMALL, 6.0)}
    for bends in poses.values():
        yield good(model, names, lengths, rng, bends), vector, False
    for factor in (1.0, 1e-150, 1e100):
        yield (
            good(model, names, lengths, rng, rng.uniform(-1, 1, nt), factor * FAST[0]),
            vector,
            False,
        )
    for change in changes(model.segments, model.links).values():
        other = np.array(flat(model.manifest, resolve(model.manifest, change)))
        yield good(model, names, lengths, rng, rng.uniform(-1, 1, nt)), other, False
    for where in range(len(lengths)):
        for number in NUMBERS:
            given = good(model, names, lengths, rng, rng.uniform(-1, 1, nt))
            given[where][rng.integers(lengths[where])] = number
            # not all factors are read
            yield given, vector, not np.isfinite(number) and names[where] != "factors"
    if names[0] == "q":
        for number in NUMBERS:
            yield (
                good(model, names, lengths, rng, np.full(nt, number)),
                vector,
                not np.isfinite(number),
            )
        yield [np.zeros(length) for length in lengths], vector, True  # its quaternion is zero


def good(
    model: st.Model, names: list[str], lengths: list[int], rng, bends, speed: float = 10.0
) -> list[np.ndarray]:
    """Return inputs at random, q with these tail coordinates, the others of this size."""
    given = [rng.uniform(-speed, speed, length) for length in lengths]
    if names[0] == "q":
        given[0] = np.concatenate([rng.uniform(-1, 1, 3), rng.normal(size=4), bends])
    return given


def runs(model: st.Model, rng, which: int, vector: np.ndarray) -> Iterator[Case]:
    """Yield falls on the ground by every method: thrown, at huge speeds, from what is no state."""
    nt = model.nv - 6
    for method in model.manifest["simulation"]["methods"].values():
        for speed, number, kp in (
            (1, 0, 0),
            (1, 0, 50),
            (1e3, 0, 0),
            (1e150, 0, 0),
            (1, np.nan, 0),
            (1, 1e300, 0),
        ):
            q, v = drops.start(model, rng)
            q[rng.integers(model.nq)] += number
            span, begins = np.array([0.0, 1.0]), np.zeros(1)
            settings = np.array([kp, 1e-4, 1e-6, 1e-3 if method in (0, 3) else 0.0, 1e-7])
            arrays = [
                q,
                speed * v,
                np.full(nt, 1e-4),
                np.array([0.0, 0.05, 0.1, 0.25]),
                begins,
                span,
            ]
            arrays += [np.array([3.6, -0.3, 3.6, -0.3]), np.zeros(nt), settings]
            yield Case(
                f"rollout by method {method}",
                packed(model, which, 1, method, vector, arrays),
                BATCH,
            )
