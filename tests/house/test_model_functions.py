"""The methods of a model for its compiled functions are those of the table of signatures.

``make golden`` writes runtime/serpentail/model/functions.py anew.
"""

import re
import textwrap
from pathlib import Path

from serpentail_scene.signatures.arguments import LEGS, Argument
from serpentail_scene.signatures.signature import Signature
from serpentail_scene.signatures.table import ALL, OF_GIVEN, SIGNATURES

PATH = Path(__file__).parents[2] / "runtime" / "serpentail" / "model" / "functions.py"
BY_HAND = ("forward_dynamics", "forward_dynamics_external")  # one method, in model/methods.py
WIDTH = 100
# sizes as users know them, for m segments, N joints or samples, and K points that touch the ground
SIZES = {
    "nt": "2m",
    "loads": "6 + 3 (N + 1)",
    "tail_points": "N + 1",
    "parameter_numbers": "parameters",
    "leg_numbers": "8",
    "points": "K",
    "bristles": "2K",
    "airborne_state": "4 + 4m",
    "airborne_results": "7 + 4m",
    "airborne_arguments": "4 + 6m",
}
HEAD = '''\
"""The methods of a model for its compiled functions; `make golden` writes this file.

Names, meanings and shapes are those of the signatures in ``serpentail_scene``.
"""

from typing import Any

from numpy.typing import ArrayLike, NDArray

from .compiled_functions import CompiledFunctions
from .memory import Out

Array = NDArray[Any]  # of doubles, or of floats if the scene asks for them


class ModelFunctions:
    """The functions of a scene, for one state or with a leading batch axis.

    ``Model`` says what q and v are, and what a derivative with respect to q is. ``given``, only of
    models with prescribed joints, also in place of ``legs``: their angles (rad), then rates, then
    accelerations, (3, n), in the order of the chains. ``inverse_dynamics`` then returns (force, the
    torques of these joints).

    Raises
    ------
    StateError
        A shape is wrong, a value is not finite, or legs are missing or do not belong.
    ModelError
        The scene left the function out.
    """

    kernels: CompiledFunctions
'''


def text_of_methods() -> str:
    """Return the text of the file."""
    signatures = [SIGNATURES[name] for name in ALL if name not in BY_HAND]
    return HEAD + "".join(method(each) for each in signatures if each.outputs)


def method(signature: Signature) -> str:
    """Return the text of one method."""
    names = [argument.name for argument in signature.inputs]
    typed = [f"{name}: ArrayLike" for name in names]
    call = f'self.kernels["{signature.name}"]({", ".join(names)}, out=out)'
    if LEGS in signature.inputs:
        typed[-1] += " | None = None"
        given = ", ".join(names[:-1])
        call = f'self.kernels.with_legs("{signature.name}", legs, {given}, out=out)'
    elif signature.name in OF_GIVEN:
        call = call.replace(", out=", ", *given, out=")
    typed += ["*given: ArrayLike" if "*given" in call else "*", "out: Out = None"]
    results = ", ".join(["Array"] * len(signature.outputs))
    result = f"tuple[{results}]" if len(signature.outputs) > 1 else results
    of_state = [name for name in names if name in ("q", "v")]
    lines = [
        *definition(signature.name, typed, result),
        *wrapped('"""', f"Compute {article(signature.doc)}{signature.doc}.", 8),
        *("", *heading("Parameters"), *state(of_state)),
        *(line for each in signature.inputs[len(of_state) :] for line in entry(each, "array_like")),
        *("", *heading("Returns")),
        *(line for each in signature.outputs for line in entry(each, "ndarray")),
        '        """',
        f"        return {call}",
    ]
    return "\n" + "\n".join(lines) + "\n"


def definition(name: str, typed: list[str], result: str) -> list[str]:
    """Return the lines of a method's head, as ruff would lay them out."""
    arguments = ", ".join(["self", *typed])
    line = f"    def {name}({arguments}) -> {result}:"
    if len(line) <= WIDTH:
        return [line]
    if len(arguments) + 8 <= WIDTH:
        return [f"    def {name}(", f"        {arguments}", f"    ) -> {result}:"]
    each = [f"        {argument}," for argument in ("self", *typed)]
    return [f"    def {name}(", *each, f"    ) -> {result}:"]


def article(doc: str) -> str:
    """Return "the " before a noun, nothing before a formula or the name of a function."""
    return "" if re.search("[_^]", doc.split(maxsplit=1)[0]) else "the "


def heading(title: str) -> list[str]:
    return [f"        {title}", f"        {'-' * len(title)}"]


def state(names: list[str]) -> list[str]:
    """Return the entry of q, or of q and v, which the docstring of ``Model`` describes."""
    if names == ["q", "v"]:
        return ["        q, v : array_like, shapes (nq,) and (nv,)"]
    return ["        q : array_like, shape (nq,)"] if names else []


def entry(argument: Argument, kind: str) -> list[str]:
    """Return the lines about an argument: name, shape and meaning."""
    sizes = [SIZES.get(str(size), str(size)) for size in argument.sizes]
    comma = "," if len(sizes) == 1 else ""
    what = f"{kind}, shape ({', '.join(sizes)}{comma})"
    if kind == "ndarray" and argument.sizes == (1,):
        what = "float"
    if argument == LEGS:
        what = f"{what}, optional; models with feet need it"
    meaning = argument.meaning
    if re.match(r"[a-z]+\b(?![_^(])", meaning):
        meaning = meaning[0].upper() + meaning[1:]
    return [f"        {argument.name} : {what}", *wrapped("", f"{meaning}.", 12)]


def wrapped(first: str, text: str, indent: int) -> list[str]:
    """Return a text in lines of at most WIDTH columns."""
    space = " " * indent
    return textwrap.wrap(text, WIDTH, initial_indent=space + first, subsequent_indent=space)


def test_methods_are_those_of_the_signatures(request):
    made = text_of_methods()
    if request.config.getoption("--update-golden"):
        PATH.write_text(made, encoding="utf-8")
    else:
        assert PATH.read_text(encoding="utf-8") == made, "run `make golden`"
