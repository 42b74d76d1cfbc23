"""The schedule of straight lines: every value once, after what it needs, and the same results."""

import random
from itertools import pairwise

from serpentail_codegen.functions.function import assemble
from serpentail_codegen.functions.plain import FUNCTIONS
from serpentail_codegen.functions.tail import Tail
from serpentail_codegen.ir.interpret import unroll
from serpentail_codegen.ir.tape import Tape, live_nodes
from serpentail_codegen.passes import schedule
from tests.support.rows import row


def straight(segments, links):
    """Nodes and results of forward dynamics."""
    tape, outputs, guards = unroll(assemble(FUNCTIONS["forward_dynamics"], Tail(segments, links)))
    return tape.nodes, [*outputs["v_dot"], *(node for _, node in guards)]


def random_line(seed, length=120):
    """Nodes of a random straight line over three inputs, and its last values."""
    rng, tape = random.Random(seed), Tape()
    nodes = [tape.input(k) for k in range(3)]
    while len(tape.nodes) < length:
        a, b = rng.choice(nodes[-12:]), rng.choice(nodes)
        nodes.append(getattr(tape, rng.choice(["add", "sub", "mul"]))(a, b))
    return tape.nodes, nodes[-3:]


def assert_valid(nodes, live, order):
    """The order has every live node once, operands before their use."""
    assert sorted(order) == sorted(live)
    place = {n: k for k, n in enumerate(order)}
    for n in order:
        if nodes[n][0] not in schedule.LEAVES:
            assert all(place[a] < place[n] for a in nodes[n][1:])


def scheduled_by_the_rule(nodes, live, results):
    """The rule as it is stated: at every step, look at all that is ready."""
    operations = [n for n in live if nodes[n][0] not in schedule.LEAVES]
    needs = {n: {a for a in nodes[n][1:] if a in operations} for n in operations}
    users = {n: {u for u in operations if n in needs[u]} for n in operations}
    height = {}
    for n in reversed(operations):
        beyond = max((height[u] for u in users[n]), default=0)
        height[n] = beyond + schedule.LATENCY.get(nodes[n][0], 4)

    order, alive = [], 0
    while len(order) < len(operations):
        ready = [n for n in operations if n not in order and needs[n] <= set(order)]
        frees = {
            n: sum(a not in results and users[a] - set(order) == {n} for a in needs[n])
            for n in ready
        }
        if alive >= schedule.REGISTERS:
            best = max(ready, key=lambda n: (frees[n], height[n], -n))
        else:
            best = max(ready, key=lambda n: (height[n], frees[n], -n))
        order.append(best)
        alive += 1 - frees[best]
    return [n for n in live if nodes[n][0] in schedule.LEAVES] + order


def test_the_order_is_that_of_the_rule(monkeypatch):
    for seed in range(10):
        nodes, results = random_line(seed)
        more = [*results, *random.Random(seed).sample(range(3, len(nodes)), 20)]
        for registers in (3, 8, 24):
            monkeypatch.setattr(schedule, "REGISTERS", registers)
            for wanted in (results, more):
                live = live_nodes(nodes, wanted)
                order = schedule.scheduled(nodes, live, wanted)
                with row(seed, registers):
                    assert_valid(nodes, live, order)
                    assert order == scheduled_by_the_rule(nodes, live, wanted)


def test_functions_keep_their_dependencies_and_change_their_order():
    for size in ((1, 1), (1, 3), (3, 2)):
        nodes, results = straight(*size)
        live = live_nodes(nodes, results)
        order = schedule.scheduled(nodes, live, results)
        with row(size):
            assert_valid(nodes, live, order)
            assert order != live
            assert order == schedule.scheduled(nodes, live, results)
    nodes, results = straight(3, 4)  # long lines are left alone
    live = live_nodes(nodes, results)
    assert schedule.scheduled(nodes, live, results) == live


def test_lines_of_much_independent_work_are_left_alone():
    """Pairs of a sum and its product, 8 cycles: enough to be busy in any order, or one less."""
    for more, alone in ((0, False), (1, True)):
        tape, pairs = Tape(), 4 * schedule.MOST_ABREAST + more
        x = [tape.input(k) for k in range(pairs + 1)]
        results = [tape.mul(tape.add(a, b), a) for a, b in pairwise(x)]
        live = live_nodes(tape.nodes, results)
        assert (schedule.scheduled(tape.nodes, live, results) == live) == alone


def test_the_longest_path_starts_first():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    short = tape.add(x, y)
    slow = tape.div(x, y)
    last = tape.mul(tape.mul(slow, x), y)
    live = live_nodes(tape.nodes, [short, last])
    order = [n for n in schedule.scheduled(tape.nodes, live, [short, last]) if n not in (x, y)]
    assert order[0] == slow and order[-1] == short
