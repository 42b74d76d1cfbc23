"""Makes one small change at a time in the sources, and checks that a test notices: `make mutants`.

A mutant has another comparison, operator, number, condition, call or result, or lacks a statement.
Mutants are drawn in equal parts from the generator, its templates and the runtime, never from
docstrings, messages or types. The tests that run the changed line are run, those named like the
file first; the first that fails kills the mutant. Tests that compare texts do not count. Controls
come first: a broken file must be noticed, and the same file unbroken must not. Below 95 % the
command fails; equivalent.toml says which survivors no test can notice. Verdicts are kept in
output/mutants: after an interruption the same command goes on.
"""

import argparse
import os
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from queue import Queue

from examples import front
from serpentail.basics.progress import Stage

from . import processes, tree
from .judge import NotLoaded, Tree
from .mutation import Mutation
from .recorded import Recorder
from .results import Verdict, keep, kept, report, score
from .sample import drawn

WANTED = 95.0  # percent of the mutants that tests should notice
# One much-used file of each part: tests must fail if it is broken, and pass if it is not.
CONTROLS = {
    "codegen/serpentail_codegen/ir/tape.py": b"\nraise RuntimeError('control')\n",
    "codegen/serpentail_codegen/targets/c/templates/math/ldl.c.jinja": b"{{ control }}",
    "runtime/serpentail/basics/attitude.py": b"\nraise RuntimeError('control')\n",
}


def arguments() -> argparse.Namespace:
    """Return the command line's arguments."""
    p = front.parser(__doc__)
    p.add_argument("--mutants", type=front.count, default=200, help="how many to run")
    p.add_argument("--seed", type=int, default=1, help="of the sample")
    p.add_argument("--jobs", type=front.count, default=2, help="mutants at the same time")
    p.add_argument("--only", default="", help="only mutants of files whose path has this")
    return p.parse_args()


def controlled(place: Tree) -> None:
    """Stop if tests do not notice a broken file, or fail on an unchanged one."""
    for path, end in CONTROLS.items():
        source = (tree.BASE / path).read_bytes()
        as_it_is = Mutation(path, 1, 0, 0, "", "", f"control of {path}")
        for text, wanted in ((source + end, True), (source, False)):
            noticed, by, words, tests = place.judged(as_it_is, text, most=10.0)
            if noticed != wanted or not tests:
                raise SystemExit(
                    f"control {path}: noticed is {noticed}, not {wanted}, by {by!r} of {tests} "
                    f"tests: {words}"
                )
        print(f"control {path}: noticed when broken, and only then", flush=True)


def judged(place: Tree, mutation: Mutation, state: str) -> Verdict:
    """Return the verdict on a mutant, and store it."""
    begun = time.monotonic()
    mutated = mutation.of((tree.BASE / mutation.path).read_bytes())
    try:
        killed, by, words, tests = place.judged(mutation, mutated)
    except NotLoaded as error:
        killed, by, words, tests = False, "", str(error), 0
    took = round(time.monotonic() - begun, 1)
    found = Verdict(mutation, killed, by, words, tests, took, tree.digest(mutation.path), state)
    keep(found)
    return found


def all_judged(sample: list[Mutation], state: str, jobs: int) -> Iterator[Verdict]:
    """Yield the verdict on each mutant as soon as it is known."""
    waiting = [mutation for mutation in sample if kept(mutation, state) is None]
    yield from (kept(mutation, state) for mutation in sample if mutation not in waiting)
    if not waiting:
        return
    recorder, places = Recorder(), Queue()
    for k in range(jobs):
        places.put(Tree(f"tree{k}", recorder))
    controlled(places.queue[0])

    def one(mutation: Mutation) -> Verdict:
        place = places.get()
        try:
            return judged(place, mutation, state)
        finally:
            places.put(place)

    pool = ThreadPoolExecutor(jobs)
    try:
        for done in as_completed([pool.submit(one, mutation) for mutation in waiting]):
            yield done.result()
    except BaseException:
        processes.stopped.set()
        raise
    finally:  # on Ctrl-C, end the running ones and start no others
        pool.shutdown(cancel_futures=True)


def main(options: argparse.Namespace) -> int:
    """Run the sample; return 1 if too few mutants were noticed."""
    os.nice(5)
    tree.snapshot()
    state = tree.state(tests=True)
    sample = drawn(tree.BASE, options.mutants, options.seed, options.only)
    verdicts: list[Verdict] = []
    try:
        with Stage("mutants") as stage:
            for found in all_judged(sample, state, options.jobs):
                verdicts.append(found)
                end = "killed" if found.killed else "SURVIVED"
                stage.tell(len(verdicts) / len(sample), f"{found.mutation} {end}")
    finally:
        print(report(verdicts))
    return 0 if len(verdicts) == len(sample) and score(verdicts) >= WANTED else 1


if __name__ == "__main__":
    front.run(main, arguments(), after=front.GOES_ON)
