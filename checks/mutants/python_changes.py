"""The changes that a mutation may make to a node of Python's syntax: comparisons, arithmetic,
constants, calls, returns, deleted statements.
"""

import ast
from collections.abc import Iterator
from copy import copy
from functools import singledispatch

COMPARISONS = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
ARITHMETIC = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}
# arguments that are texts for people, and the check of zip
SAFE = {"encoding", "strict", "help", "metavar", "prog", "description"}
TEXT = (ast.JoinedStr,)


@singledispatch
def changes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield possible replacements of a node; none for most kinds."""
    yield from ()


@changes.register
def _(node: ast.Compare) -> Iterator[ast.AST]:
    for k, op in enumerate(node.ops):
        for other in COMPARISONS[type(op)]:
            yield with_(node, ops=[*node.ops[:k], other(), *node.ops[k + 1 :]])


@changes.register
def _(node: ast.BinOp) -> Iterator[ast.AST]:
    other = ARITHMETIC.get(type(node.op))
    if other and not any(is_text(side) for side in (node.left, node.right)):
        yield with_(node, op=other())


@changes.register
def _(node: ast.BoolOp) -> Iterator[ast.AST]:
    yield with_(node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And())
    yield from (
        with_(node, values=[*node.values[:k], *node.values[k + 1 :]])
        for k in range(len(node.values))
        if len(node.values) > 2
    )


@changes.register
def _(node: ast.UnaryOp) -> Iterator[ast.AST]:
    if isinstance(node.op, ast.Not | ast.USub):
        yield node.operand


@changes.register
def _(node: ast.Constant) -> Iterator[ast.AST]:
    if isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node.value, int):
        yield ast.Constant(node.value + 1)
    elif isinstance(node.value, float):
        yield ast.Constant(1.5 * node.value or 1.0)


@changes.register
def _(node: ast.Call) -> Iterator[ast.AST]:
    plain = [k for k, a in enumerate(node.args) if not isinstance(a, ast.Starred)]
    if len(plain) > 1 and plain[:2] == [0, 1]:
        first, second, *rest = node.args
        if not (is_text(first) or is_text(second) or ast.unparse(first) == ast.unparse(second)):
            yield with_(node, args=[second, first, *rest])
    for k, keyword in enumerate(node.keywords):
        if keyword.arg not in {None, *SAFE}:
            yield with_(node, keywords=[*node.keywords[:k], *node.keywords[k + 1 :]])


@changes.register
def _(node: ast.IfExp) -> Iterator[ast.AST]:
    yield with_(node, test=negated(node.test))


@changes.register
def _(node: ast.ListComp | ast.SetComp | ast.GeneratorExp | ast.DictComp) -> Iterator[ast.AST]:
    for k, part in enumerate(node.generators):
        if part.ifs:
            open_ = with_(part, ifs=part.ifs[:-1])
            yield with_(node, generators=[*node.generators[:k], open_, *node.generators[k + 1 :]])


@changes.register
def _(node: ast.Return) -> Iterator[ast.AST]:
    if node.value is not None and ast.unparse(node.value) != "None":
        yield with_(node, value=ast.Constant(None))


@changes.register
def _(node: ast.AugAssign) -> Iterator[ast.AST]:
    yield ast.Pass()
    other = ARITHMETIC.get(type(node.op))
    if other and not is_text(node.value):
        yield with_(node, op=other())


@changes.register
def _(node: ast.Assign) -> Iterator[ast.AST]:
    if all(isinstance(target, ast.Attribute | ast.Subscript) for target in node.targets):
        yield ast.Pass()


@changes.register
def _(node: ast.Expr | ast.Raise | ast.Continue | ast.Break) -> Iterator[ast.AST]:
    if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant | ast.Yield)):
        yield ast.Pass()


def with_(node: ast.AST, **fields) -> ast.AST:
    """Return a copy of a node with other fields."""
    made = copy(node)
    for name, value in fields.items():
        setattr(made, name, value)
    return made


def negated(test: ast.expr) -> ast.expr:
    """Return the opposite of a condition."""
    return ast.UnaryOp(ast.Not(), test)


def is_text(node: ast.AST) -> bool:
    """Tell if a node is a string."""
    return isinstance(node, TEXT) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
