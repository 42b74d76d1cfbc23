"""Conditions that differ from lane to lane: what they ask for is stored where they hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...ir.program import Apply, Copy, Ref, When, statements
from ..target import body_lines, refused
from .routine import each_lane, pointer, scalar, singles

if TYPE_CHECKING:
    from .loops import LoopPrinter


def when_in_lanes(printer: LoopPrinter, when: When, condition: Ref) -> list[str]:
    """Print a body that runs if the condition holds in a lane, and stores in such lanes alone."""
    for statement, _ in statements(when.body):
        if not isinstance(statement, Apply | Copy):
            raise refused(printer, statement, "it cannot be done in some lanes alone")
    outer, row = printer.where, condition.array.row
    name = f"where_{len(outer) + 1}"
    copy = f"{printer.helper('copy_rows')}({row}, {pointer(condition)}, {name});"
    if outer:
        arguments = f"{row}, {outer[-1]}, {pointer(condition)}, {name}"
        copy = f"{printer.helper('both_positive')}({arguments});"
    test = f"if ({printer.helper('any_positive')}({row}, {name})) {{"

    # the condition is copied, because its body may overwrite it
    printer.where = (*outer, name)
    body = body_lines(printer, when.body)
    printer.where = outer
    lines = [f"real {name}[{row}];", copy, test, *("  " + line for line in body), "}"]
    printer.helpers |= {"lanes", "wide_select"}
    return ["{", *("  " + line for line in lines), "}"]


def stored_where(printer: LoopPrinter, call: Apply) -> frozenset[str]:
    """Return the outputs of a step that are stored in some lanes alone; others are copied."""
    if not printer.where:
        return frozenset()
    outputs = call.outputs()
    if not all(ref.lanes for ref in outputs.values()):
        raise refused(printer, call, "a number has no lanes to be stored in")
    return frozenset(name for name, ref in outputs.items() if ref.stride == 1)


def copied_where(printer: LoopPrinter, target: Ref, source: Ref, adds: bool) -> list[str]:
    """Print a copy in the lanes where the condition holds."""
    row, where = target.array.row, printer.where[-1]
    if source.lanes:
        numbers = [f"LOAD({pointer(one)} + c)" for one in singles(source)]
    else:
        numbers = [f"WIDE({scalar(source, k)})" for k in range(source.size)]
    lines = []
    for number, one in zip(numbers, singles(target), strict=True):
        address = f"{pointer(one)} + c"
        value = f"LOAD({address}) + {number}" if adds else number
        chosen = f"{printer.prefix}_select_row(LOAD({where} + c), {value}, LOAD({address}))"
        lines.append(f"STORE({address}, {chosen});")
    return each_lane(str(row), lines)
