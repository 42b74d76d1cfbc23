"""A model as a functional mock-up unit, FMI 2.0: its description, its C, and its library."""

import hashlib
import platform
from pathlib import Path, PurePosixPath

from ...basics.errors import ExportError
from ...compiling.compiler import library_of_texts
from ...model.model import Model
from ...simulation.methods import DOUBLE_RTOL
from .bundle import zipped
from .description import description, height, legs

FLYING = ("forward_dynamics", "forward_dynamics_derivatives", "rollout")
TOUCHING = ("contact_dynamics", "contact_points", "rollout")
NATIVE = Path(__file__).with_name("native")  # names with hyphens, which no model can have
PLATFORMS = {("Linux", "x86_64"): "linux64"}  # the standard's names of those that this runs on
HIDDEN = ("-fvisibility=hidden",)  # several units in one process share no function


def fmu(model: Model) -> bytes:
    """Return the file.

    ExportError if no FMU can be made of the model, ModelError if its scene left out a function,
    CompilerNotFound and CompileFailed as ``st.load``.
    """
    _refuse_others(model)
    sources = _sources(model)
    names = sorted(name for name in sources if name.endswith(".c"))
    texts = [*(sources[name] for name in sorted(sources)), description(model, "", names)]
    guid = hashlib.sha256(b"".join(texts)).hexdigest()[:32]
    sources["the-model.h"] += f'#define GUID "{guid}"\n'.encode()
    files = {f"sources/{name}": content for name, content in sources.items()}
    files["modelDescription.xml"] = description(model, guid, names)
    place = PLATFORMS.get((platform.system(), platform.machine()))
    if place is not None:  # on other platforms there are only the sources
        files[f"binaries/{place}/{model.name}.so"] = _library(sources)
    return zipped(files)


def _refuse_others(model: Model) -> None:
    """Refuse models that an FMU cannot hold."""
    scene = model.manifest["scene"]
    if model.fixed:
        raise _refused(model, "base", "fixed", 'an FMU needs a torso that moves: give "free" to')
    if scene["coordinates"] == "polar":
        words = 'polar angles have no rates where a segment is straight: give "bend" to'
        raise _refused(model, "coordinates", "polar", words)
    if model.manifest["real"] != "double":
        raise _refused(model, "real", model.manifest["real"], 'FMI uses double: give "double" to')
    needs = TOUCHING if model.contacts else FLYING
    if "c" not in scene["targets"]:
        raise model.without(*needs)
    model.need(*needs)


def _refused(model: Model, field: str, value: object, words: str) -> ExportError:
    """Return the error about a field of the model's scene."""
    return ExportError(
        f"{field}: value {value!r} of {model.name}: {words} the scene, and generate it again"
    )


def _sources(model: Model) -> dict[str, bytes]:
    """Return the C by file name: the model's, the unit's, and what the unit needs to know."""
    files, native = model.checked.files, sorted(NATIVE.glob("*.[ch]"))
    sources = {PurePosixPath(n).name: text for n, text in files.items() if n.endswith(".h")}
    for name in (f"{model.name}.c", f"{model.name}_simulation.c"):
        sources[name] = files[f"src/{name}"]
    sources |= {path.name: path.read_bytes() for path in native}
    return sources | {"the-model.h": _names(model).encode()}


def _names(model: Model) -> str:
    """Return the header that names the model, its sizes and its values at the start."""
    values = [] if model.manifest["scene"]["baked"] else model.parameter_vector.tolist()
    work = model.manifest["work"]
    sizes = {"NQ": model.nq, "NV": model.nv, "NT": model.layout.nt, "NP": len(values)}
    sizes["WORK"] = max(work[name] for name in (TOUCHING if model.contacts else FLYING))
    method = "ros34pw2" if "implicit_factor" in work and model.contacts else "tsit5"
    lines = [
        "/* The model, its sizes, and the values of its parameters, with a 0 behind them. */",
        f'#include "{model.name}.h"',
        f'#include "{model.name}_simulation.h"',
        f"#define MODEL(name) {model.name}_##name",
        f"enum {{ {', '.join(f'{name} = {size}' for name, size in sizes.items())} }};",
        f"#define POINTS {sum(model.contacts.values())} /* that can touch the ground */",
        f"#define LEGS {legs(model)} /* numbers of legs */",
        f"#define HEIGHT {height(model)!r} /* m, of B */",
        f"#define METHOD {model.name.upper()}_{method.upper()} /* of co-simulation */",
        f"#define TOLERANCE {DOUBLE_RTOL[method]!r} /* unless the experiment has one */",
        f"#define VALUES ((const double[]){{{', '.join(map(repr, [*values, 0.0]))}}})",
    ]
    return "\n".join(lines) + "\n"


def _library(sources: dict[str, bytes]) -> bytes:
    """Return the shared library, which runs on any processor of this family."""
    folders = {".c": "src", ".h": "include"}
    texts = {f"{folders[name[-2:]]}/{name}": text for name, text in sources.items()}
    return library_of_texts(texts, "reproducible", HIDDEN).read_bytes()
