"""Steps: compacted they keep what they mean, with constants they are folded."""

import random

import pytest

from serpentail_codegen.ir.step import Step, compacted, specialised
from serpentail_codegen.ir.tape import BINARY, Tape, live_nodes, operation_count, replay
from tests.support.algebras import FLOATS
from tests.support.random_tapes import INPUTS, SEEDS, grow


def reachable(nodes, node, found):
    """Collect a node and all below it."""
    if node not in found:
        found.add(node)
        if nodes[node][0] not in ("input", "const"):
            for arg in nodes[node][1:]:
                reachable(nodes, arg, found)
    return found


def random_step(seed):
    """A step of two 2-vectors with three scalars of output, most of its nodes dead."""
    rng, tape = random.Random(seed), Tape()
    pool = grow(rng, FLOATS, tape, [rng.uniform(-3, 3) for _ in range(INPUTS)], 25)
    results = tuple(node for node, _ in rng.sample(pool, 3))
    return Step(
        "step", "Random.", (("x", 2), ("y", 2)), (("u", 1), ("w", 2)), tuple(tape.nodes), results
    )


def evaluated(step, **vectors):
    """Return the scalars of a step's outputs."""
    nodes = replay(
        step.nodes, [scalar for name, _ in step.inputs for scalar in vectors[name]], FLOATS
    )
    return [nodes[result] for result in step.results]


@pytest.mark.parametrize("seed", SEEDS)
def test_live_nodes_are_what_the_results_reach(seed):
    step = random_step(seed)
    live = set()
    for result in step.results:
        reachable(step.nodes, result, live)
    assert live_nodes(step.nodes, step.results) == sorted(live)
    assert operation_count(step.nodes, step.results) == sum(
        step.nodes[node][0] in BINARY for node in live
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_compacted_step_keeps_meaning_and_drops_the_rest(seed):
    step = random_step(seed)
    small = compacted(step)
    rng = random.Random(
        seed
    )  # the scalars with which the step grew: none of its square roots is of a negative
    vectors = {name: [rng.uniform(-3, 3) for _ in range(size)] for name, size in step.inputs}
    assert evaluated(small, **vectors) == evaluated(step, **vectors)
    assert live_nodes(small.nodes, small.results) == list(range(len(small.nodes)))
    assert small.outputs == step.outputs
    assert set(small.inputs) <= set(step.inputs)
    read = {index for op, index, *_ in small.nodes if op == "input"}
    spans, first = [], 0
    for _, size in small.inputs:
        spans.append(set(range(first, first + size)))
        first += size
    assert all(span & read for span in spans) and read <= set().union(*spans)
    assert compacted(small) == small


def test_specialised_step_is_the_step_at_these_values():
    tape = Tape()
    x, y, z, w = (tape.input(k) for k in range(4))
    results = (tape.add(tape.mul(x, y), z), tape.div(w, y))
    step = Step(
        "step", "Two vectors.", (("a", 2), ("b", 2)), (("u", 2),), tuple(tape.nodes), results
    )
    still = specialised(step, "still", a=(0, 2))
    assert (still.name, still.doc, still.inputs, still.outputs) == (
        "still",
        step.doc,
        (("b", 2),),
        step.outputs,
    )
    assert evaluated(still, b=(3.0, 5.0)) == evaluated(step, a=(0, 2), b=(3.0, 5.0)) == [3.0, 2.5]
    assert operation_count(still.nodes, still.results) == 1
    assert specialised(step, "step") == step
