"""Functions of the model without change, with dense inputs and outputs."""

from ....functions.catalogue import function_of
from .dynamics import DYNAMICS
from .ports import External, Port, pattern


def plain(e: External, name: str, sizes: dict[str, int]) -> None:
    """Make a function of the model with dense ports."""
    function = function_of(name, e.tail)
    names = [a.name for a in (*function.inputs, *function.outputs)]
    e.call(name, *names)

    # no derivatives by parameters if the scene left them out but has others
    fixed = any(
        f.name == name and f.has(e.works, "jac_") and not f.by_parameters(e.works) for f in DYNAMICS
    )
    e.inputs = [Port(a.name, pattern(a.length(e.tail), 1), a.name) for a in function.inputs]
    e.inputs.append(Port("parameters", pattern(sizes["parameters"], 1), differentiable=not fixed))

    # matrices are row-major in C, so neighbours in a column are a row apart
    for a in function.outputs:
        shape, length = a.shape(e.tail), a.length(e.tail)
        columns = shape[-1] if len(shape) > 1 else 1
        e.outputs.append(Port(a.name, pattern(length // columns, columns), a.name, columns))
