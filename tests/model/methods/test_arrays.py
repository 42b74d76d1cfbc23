"""Every function takes any array of numbers and leaves it alone; what none takes is named."""

import copy
import gc
import re
import weakref

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import serpentail as st
from serpentail_scene.signatures.table import ALL, NEEDS, SIGNATURES
from tests.support import zoo
from tests.support.forms import SOUND, Foreign

from ...support.rows import row
from .conftest import ARGUMENTS, CALLS, SIZES, assert_same, call, shapes, state, states

ELSEWHERE = {"rollout", "implicit", "gradients", "loads", *NEEDS}  # tested in files of their own
ONE = "forward_dynamics_external"  # on which every form and every wrong value is tried


def test_every_function_is_called_here(model):
    assert {*CALLS, *ELSEWHERE} == {*ALL, *(name for name in NEEDS if SIGNATURES[name].called)}
    assert repr(model) == "<serpentail.Model m2_n2: 2 x 2 links, nv = 10>"


def test_outputs_are_plain_arrays_of_the_callers_own_and_arguments_are_left_alone(model):
    for name in CALLS:
        for lead in ((), (0,), (1,), (3,)):
            with row(name, lead):
                given, other = (states(*lead, seed) if lead else state(seed) for seed in (1, 2))
                before, kept = copy.deepcopy(given), call(model, name, given)
                for output, shape in zip(kept, shapes(name), strict=True):
                    assert output.shape == lead + shape
                    assert output.dtype == np.float64 and np.isfinite(output).all()
                    assert not output.ndim or (output.flags.carray and output.flags.writeable)
                copies = copy.deepcopy(kept)
                for output in call(model, name, other):
                    if output.ndim:
                        output[...] = np.nan
                assert_same(kept, copies)
                assert_same(call(model, name, given), copies)
                assert_same(given.values(), before.values())


def test_batch_is_its_states_one_by_one_in_any_layout_and_type(model):
    for name in CALLS:
        for count, apart in ((1, 1), (500, 97)):
            batch = states(count)
            found = call(model, name, batch)
            for k in range(0, count, apart):
                with row(name, count, k):
                    alone = call(model, name, {key: rows[k] for key, rows in batch.items()})
                    assert_same([output[k] for output in found], alone)
    batch, one = states(5), state(seed=2)
    for name, arguments in ARGUMENTS.items():
        for varied in arguments:
            with row(name, varied):
                mixed = one | {varied: batch[varied]}
                repeated = {key: np.broadcast_to(mixed[key], (5, SIZES[key])) for key in arguments}
                assert_same(call(model, name, mixed), call(model, name, repeated))
    # neither layout nor type matters: every kind for one function, one kind for every function
    types = (np.float32, np.float16, np.int64, np.int8, np.uint16)
    whole = {key: np.arange(1.0, 1 + size) % 5 for key, size in SIZES.items()}
    ways = [(form, SOUND[form], given) for form in SOUND for given in (state(), states(3))]
    ways += [(each.__name__, lambda a, each=each: a.astype(each), whole) for each in types]
    ways += [("whole numbers", lambda a: a.astype(int).tolist(), whole)]
    for form, change, given in ways:
        for name in CALLS if form in ("list", "float32") else [ONE]:
            with row(form, name):
                changed = {key: change(value) for key, value in given.items()}
                assert_same(call(model, name, changed), call(model, name, given))


def of_arguments(rows):
    """Yield function, argument and value: the first on every argument of all, others on ONE's."""
    for k, value in enumerate(rows):
        for name in ARGUMENTS if k == 0 else [ONE]:
            for argument in ARGUMENTS[name]:
                yield name, argument, value


def refuse(model, name, arguments, words):
    with pytest.raises(st.StateError, match=f"^{name}: {words}"):
        call(model, name, arguments)


def test_other_things_than_real_numbers_are_refused(model):
    kinds = (bool, complex, np.complex64, object, "datetime64[s]")
    values = [np.ones(11, kind) for kind in kinds]
    values += [["1.0"] * 11, [None] * 11, None, "upright", {1.0, 2.0}, [[1.0], [1.0, 2.0]]]
    for name, argument, value in of_arguments([*values, Foreign()]):
        if argument == "f_ext" and value is None:
            continue  # no load
        with row(name, argument, value):
            refuse(model, name, state() | {argument: value}, f"{argument}: .*real numbers")
    for name, argument, given in of_arguments([state(), states(5)]):
        with row(name, argument):
            masked = np.ma.masked_array(given[argument], np.zeros(given[argument].shape, bool))
            masked[..., 2] = np.ma.masked
            words = f"{argument}: {masked.size // masked.shape[-1]} masked entries"
            refuse(model, name, given | {argument: masked}, words)


def test_wrong_shape_is_named_with_the_right_one(model):
    changes = [lambda n: (n - 1,), lambda n: (n + 1,), lambda _: (), lambda _: (0,)]
    changes += [lambda n: (3, n - 1), lambda n: (n, 2), lambda n: (2, 2, n), lambda n: (n, 1)]
    for name, argument, change in of_arguments([*changes, lambda _: (1, 0)]):
        size = SIZES[argument]
        shape = change(size)
        with row(name, argument, shape):
            words = f"{argument} has shape {shape}, not ({size},) or (batch, {size})"
            refuse(model, name, state() | {argument: np.zeros(shape)}, re.escape(words))
    for counts, told in (((3, 5, 1), "1, 3, 5"), ((1, 0, 1), "0, 1")):
        of_counts = zip(("q", "v", "tau"), counts, strict=True)
        arguments = {argument: states(count)[argument] for argument, count in of_counts}
        refuse(model, "forward_dynamics", arguments, rf".*\({told}\)")
    for arguments in ([], [np.zeros(3)] * 2, [np.zeros(3)] * 12):
        with pytest.raises(TypeError, match="forward_dynamics takes q, v, tau"):
            model.kernel("forward_dynamics")(*arguments)


def test_what_gives_no_finite_result_is_named_with_its_place(model):
    for name, argument, bad in of_arguments([np.nan, np.inf, -np.inf]):
        one, batch = state(), states(9)
        one[argument][1], batch[argument][6, 2] = bad, bad
        with row(name, argument, bad):
            refuse(model, name, one, rf"{argument}\[1\]: value {bad}")
            refuse(model, name, batch, rf"{argument}\[2\] of state 6: value {bad}")
    one, batch = state(), states(9)  # whose results are beyond numbers
    one["v"] *= 1e200
    batch["v"][6] *= 1e200
    for name in ("bias_force", "forward_dynamics", "energy"):
        for arguments, where in ((one, ""), (batch, " of state 6")):
            refuse(model, name, arguments, f"the result{where} is not finite")
    norms = {0.0: "is zero", 1e-160: "has norm 1e-160", 1e200: r"has norm 1e\+200"}
    for norm, words in norms.items():
        for name in ARGUMENTS if norm == 0 else ["energy", "airborne_rates"]:
            argument = ARGUMENTS[name][0]
            where, place = {"q": (slice(3, 7), "3:7"), "x": (slice(0, 4), "0:4")}[argument]
            one, batch = state(), states(9)
            one[argument][where] = batch[argument][6, where] = 0, norm, 0, 0
            with row(name, norm):
                refuse(model, name, one, rf"the quaternion {argument}\[{place}\] {words}")
                refuse(model, name, batch, rf"the quaternion .*{place}\] of state 6 {words}")


@pytest.mark.filterwarnings("ignore::serpentail.basics.errors.UnusualSize")
def test_indefinite_inertia_is_named():
    """A tail so long that H overflows."""
    with pytest.warns(st.UnlikeBodies, match="factor of inf"):
        parameters = {"link_inertia": (1, 1, 1), "tail_length": 1e200}
        endless = st.load(zoo.folder("m2_n2"), parameters)
    for arguments, where in ((state(), ""), (states(2), " of state 0")):
        words = f"the inertia matrix{where} is not positive definite"
        refuse(endless, "forward_dynamics", arguments, words)


def assert_close(found, expected, rtol, atol):
    """Compare outputs; atol is a part of the largest number of each."""
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=rtol, atol=atol * np.abs(other).max())


def test_float_model(model):
    single = zoo.model("single")
    for arguments in (state(), states(3)):
        floats = {key: np.float32(a) for key, a in arguments.items()}
        for name in CALLS:
            with row(name):
                exact = call(single, name, floats)
                assert_same(call(single, name, arguments), exact)
                assert {found.dtype for found in exact} == {np.dtype(np.float32)}
                rounded = {key: a.astype(float) for key, a in floats.items()}
                assert_close(exact, call(model, name, rounded), 2e-2, 1e-3)
    with pytest.raises(st.StateError, match=r"v\[0\]: value inf"):
        single.bias_force(state()["q"], [1e39] + [0] * (SIZES["v"] - 1))


def test_quaternion_may_have_any_norm(model):
    arguments = state()
    unit = arguments["q"].copy()
    unit[3:7] /= np.linalg.norm(unit[3:7])
    for factor in (-1.0, 2.0**-40, 3.7, 1e-100, 1e100):
        scaled = np.r_[unit[:3], factor * unit[3:7], unit[7:]]
        for name in CALLS:
            with row(name, factor):
                found, expected = (call(model, name, arguments | {"q": q}) for q in (scaled, unit))
                assert_close(found, expected, 1e-11, 1e-13)


def test_names_of_the_field_and_loads_by_name(model):
    q, v, v_dot, tau, f_ext = map(state().get, ("q", "v", "v_dot", "tau", "f_ext"))
    assert_same(model.crba(q), model.mass_matrix(q))
    assert_same(model.nle(q, v), model.bias_force(q, v))
    assert_same(model.rnea(q, v, v_dot), model.inverse_dynamics(q, v, v_dot))
    for load in (None, f_ext):
        assert_same(model.aba(q, v, tau, load), model.forward_dynamics(q, v, tau, load))
    every = np.arange(1.0, 1 + SIZES["f_ext"])
    load = model.external_force(every[:3], moment=[4, 5, 6], tail=every[6:].reshape(-1, 3))
    np.testing.assert_array_equal(load, every)
    np.testing.assert_array_equal(model.external_force(), np.zeros(SIZES["f_ext"]))
    for name, value in (("force", (1, 2)), ("force", "xyz"), ("moment", 1.0), ("tail", every[6:])):
        with pytest.raises(st.StateError, match=name):
            model.external_force(**{name: value})


def test_function_left_out_is_named_with_the_remedy():
    bare = zoo.model("bare")
    for name in CALLS.keys() - {"forward_dynamics"}:
        with pytest.raises(st.ModelError, match=f"bare .*'{name}'.*forward_dynamics.*`functions`"):
            call(bare, name, state())
    with pytest.raises(st.ModelError, match=r"bare .*'energy'"):
        _ = bare.casadi.energy
    assert not hasattr(bare.casadi, "_repr_html_")


def test_kernel_keeps_what_it_needs():
    whole = st.load(zoo.folder("m2_n2"), {"tail_mass": 0.05})
    expected, kernel = whole.mass_matrix(state()["q"]), whole.kernel("mass_matrix")
    gone, *kept = map(weakref.ref, (whole, whole.parameter_vector, whole.library))
    del whole
    gc.collect()
    assert gone() is None
    assert all(reference() is not None for reference in kept)
    np.testing.assert_array_equal(kernel(state()["q"]), expected)
    del kernel
    gc.collect()
    assert kept[0]() is None


@pytest.fixture(params=["m1_n3", "arcs2"])
def moving(request):
    model, rng = zoo.model(request.param), np.random.default_rng(1)
    x = rng.normal(size=model.nq + model.nv)
    x[3:7] /= np.linalg.norm(x[3:7])
    return model, x, 1e-3 * rng.normal(size=model.layout.nt)


def test_x_dot_is_of_turns_and_accelerations_and_mends_the_norm(moving):
    """The square s of the norm follows s_dot = 2 (1 - s) s; states may be in rows."""
    (model, x, u), h = moving, 1e-6
    nq, omega, x_dot = model.nq, x[model.nq + 3 : model.nq + 6], model.x_dot(x, u)
    assert np.array_equal(x_dot[:3], x[nq : nq + 3])
    assert np.array_equal(x_dot[7:nq], x[nq + 6 :])
    assert np.array_equal(x_dot[nq:], model.forward_dynamics(x[:nq], x[nq:], u))
    turns = Rotation.from_quat(np.roll(x[3:7], -1)) * Rotation.from_rotvec(np.outer([h, -h], omega))
    after, before = (np.roll(q, 1) * np.sign(np.roll(q, 1) @ x[3:7]) for q in turns.as_quat())
    assert np.allclose(x_dot[3:7], (after - before) / (2 * h), rtol=0, atol=1e-9)
    x[3:7] *= 1.1
    expected = 1.1 * x_dot[3:7] + (1 - 1.21) * x[3:7]
    assert np.allclose(model.x_dot(x, u)[3:7], expected, rtol=1e-13, atol=1e-13)
    assert np.array_equal(model.x_dot(np.stack([x, 2 * x]), u)[0], model.x_dot(x, u))
    A, B = model.x_dot_derivatives(x, np.stack([u, 3 * u]))
    assert np.array_equal(A[1], model.x_dot_derivatives(x, 3 * u)[0])
    assert B.shape == (2, len(x), len(u))
    for wrong, words in (
        (x[1:], rf"x has shape \({len(x) - 1},\).*{len(x)}.*\({nq}\).*\({model.nv}\)"),
        (np.float64(1), r"x has shape \(\)"),
        (x * np.nan, r"x\[0\]: value nan"),
        (0 * x, "quaternion"),
    ):
        for method in (model.x_dot, model.x_dot_derivatives):
            with row(words), pytest.raises(st.StateError, match=words):
                method(wrong, u)


def test_values_and_derivatives_are_casadis_interpreted_and_compiled(moving):
    model, x, u = moving
    p, f = model.casadi.parameter_vector, model.casadi.x_dot
    compiled = model.casadi.external("x_dot", derivatives=1)
    folded = model.casadi.external("x_dot", derivatives=1, folded=True)
    assert (compiled.name_in(), folded.name_in()) == (["x", "u", "p"], ["x", "u"])
    jacobian = f.factory("J", ["x", "u", "p"], ["jac:x_dot:x", "jac:x_dot:u"])
    for norm in (1.0, 0.7):
        x[3:7] *= norm
        for found, rtol in ((f(x, u, p), 1e-9), (compiled(x, u, p), 1e-13), (folded(x, u), 1e-13)):
            assert np.allclose(found.full()[:, 0], model.x_dot(x, u), rtol=rtol, atol=rtol)
        for own, other in zip(model.x_dot_derivatives(x, u), jacobian(x, u, p), strict=True):
            assert np.abs(own - other.full()).max() < 1e-12 * np.abs(own).max()
    by_x = folded.factory("J", ["x", "u"], ["jac:x_dot:x"])(x, u).full()
    assert np.allclose(by_x, model.x_dot_derivatives(x, u)[0], rtol=1e-11, atol=1e-11)
