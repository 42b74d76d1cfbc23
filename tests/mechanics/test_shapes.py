"""A step says by annotations how many numbers its vectors hold; what does not is refused."""

import pytest
from sympy import Matrix

from serpentail_codegen.ir.builder import Builder
from serpentail_codegen.mechanics.lower import declared_shapes, derive
from serpentail_codegen.mechanics.shapes import M33, V1, V3


def carried(let, R: M33, arm: V3, scale: V1) -> dict:
    """A turned and scaled arm."""
    return {"carried": R * arm * scale[0], "matrix": R}


def unannotated(let, R: M33, arm) -> dict:
    """An arm of no shape."""
    return {"carried": R * arm}


def mistyped(let, R: M33, arm: Matrix) -> dict:
    """An arm whose type tells no shape."""
    return {"carried": R * arm}


def with_setting(let, arm: V3, twice: bool = False) -> dict:
    """An argument with a default is a setting."""
    return {"carried": arm * (2 if twice else 1)}


def test_a_step_reads_what_its_annotations_say():
    assert declared_shapes(carried) == {"R": (3, 3), "arm": (3, 1), "scale": (1, 1)}
    step = derive(carried)
    assert step.inputs == (("R", 9), ("arm", 3), ("scale", 1))
    assert step.outputs == (("carried", 3), ("matrix", 9))
    assert declared_shapes(with_setting) == {"arm": (3, 1)}


@pytest.mark.parametrize("function", [unannotated, mistyped])
def test_an_argument_without_a_shape_is_refused(function):
    with pytest.raises(TypeError, match=f"{function.__name__}: arm needs an annotation"):
        derive(function)


@pytest.mark.parametrize(("name", "size"), [("R", 3), ("arm", 4), ("carried", 2)])
def test_a_vector_of_another_size_is_refused_where_the_step_is_applied(name, size):
    sizes = {"R": 9, "arm": 3, "scale": 1, "carried": 3} | {name: size}
    builder = Builder("applied", "A step applied.")
    refs = {vector: builder.array(vector, count)[0] for vector, count in sizes.items()}
    writes = {"carried": refs.pop("carried")}
    right = {"R": 9, "arm": 3, "carried": 3}[name]
    message = f"carried.* in applied: {name} has {right} scalars, not {size}"
    with pytest.raises(ValueError, match=message):
        builder.apply(derive(carried), refs, **writes)
