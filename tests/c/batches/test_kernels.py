"""Kernels in C call a model's functions by their addresses: one state, or many that lie apart."""

import ctypes

import numpy as np
import pytest

from serpentail.model.compiler import compile_library
from serpentail.model.library import NOT_FINITE
from tests.support import zoo

from .tails import alone, evaluated, given, states

# nodes (K, x and torques, then three numbers of the kernel's own) at one angular momentum
KERNEL = """
#include <stddef.h>
typedef struct {
  const double *parameters;
  size_t count, failed;
  double *work, *arrays[10];
} Call;
typedef int (*Nodes)(Call *call, const size_t *apart);
typedef int (*Node)(const double *parameters, const double *x, const double *tau, const double *h,
                    const double *mu, double *y, double *J, double *H, double *work);
typedef struct {
  size_t count, x, tau, y, J, H;
  double *nodes, *h, *mu, *results;
  const double *parameters;
} Task;

int together(Nodes function, const Task *t, double *work, size_t *failed);
int together(Nodes function, const Task *t, double *work, size_t *failed)
{
  double *y = t->results, *J = y + t->y, *H = J + t->J;
  Call call = { t->parameters, t->count, 0, work,
                { t->nodes, t->nodes + t->x, t->h, t->mu, y, J, H } };
  const size_t result = t->y + t->J + t->H, node = t->x + t->tau + 3;
  const size_t apart[] = { node, node, 0, 0, result, result, result };
  const int status = function(&call, apart);
  *failed = call.failed;
  return status;
}

int each(Node function, const Task *t, double *work);
int each(Node function, const Task *t, double *work)
{
  for (size_t k = 0; k < t->count; ++k) {
    double *x = t->nodes + k * (t->x + t->tau + 3), *tau = x + t->x;
    double *y = t->results + k * (t->y + t->J + t->H), *J = y + t->y, *H = J + t->J;
    const int status = function(t->parameters, x, tau, t->h, t->mu, y, J, H, work);
    if (status) {
      return status;
    }
  }
  return 0;
}
"""
NAME = "airborne_rates_hessian"


class Task(ctypes.Structure):
    """What the kernel works on."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("count", "x", "tau", "y", "J", "H")),
        *((name, ctypes.c_void_p) for name in ("nodes", "h", "mu", "results", "parameters")),
    )


@pytest.fixture(scope="module")
def kernel(tmp_path_factory):
    """The kernel's library."""
    file = tmp_path_factory.mktemp("kernel") / "kernel.c"
    file.write_text(KERNEL)
    return ctypes.CDLL(str(compile_library([file], file.parent)))


def task_of(found, count, seed=0):
    """A task, its arrays, and the arguments of its nodes."""
    arguments = states(found, count, seed)
    for name in ("angular", "weights"):
        arguments[name][:] = arguments[name][0]
    nodes = np.hstack([arguments["x"], arguments["tau"], np.full((count, 3), np.nan)])
    sizes = [found.manifest["functions"][NAME]["outputs"][k]["shape"] for k in range(3)]
    y, J, H = map(int, map(np.prod, sizes))
    results = np.zeros((count, y + J + H))
    shared = [arguments[name][0].copy() for name in ("angular", "weights")]
    arrays = [nodes, *shared, results, np.array(found.parameter_vector)]
    x, tau = (arguments[name].shape[1] for name in ("x", "tau"))
    addresses = [a.ctypes.data for a in arrays]
    return Task(count, x, tau, y, J, H, *addresses), arrays, arguments


@pytest.mark.parametrize("name", ["m1_n1", pytest.param("arcs2_loops", marks=pytest.mark.slow)])
@pytest.mark.parametrize("count", [1, 8, 21])
def test_a_kernel_evaluates_nodes_that_lie_apart(kernel, name, count):
    found = zoo.model(name)
    task, arrays, arguments = task_of(found, count)
    work = np.zeros(found.batch_library.work[NAME])
    address = ctypes.c_void_p(found.batch_library.address(NAME))
    failed = ctypes.c_size_t()
    place = ctypes.c_void_p(work.ctypes.data)
    assert kernel.together(address, ctypes.byref(task), place, ctypes.byref(failed)) == 0
    expected = alone(found, NAME, arguments)
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(arrays[3] - expected) <= 1e-11 * scale).all()


def test_a_kernel_evaluates_node_after_node(kernel):
    found = zoo.model("m1_n1")
    task, arrays, arguments = task_of(found, 5)
    work = np.zeros(found.manifest["work"][NAME])
    function = found.library[f"{found.manifest['prefix']}_{NAME}"]
    address = ctypes.cast(function, ctypes.c_void_p)
    assert kernel.each(address, ctypes.byref(task), ctypes.c_void_p(work.ctypes.data)) == 0
    np.testing.assert_array_equal(arrays[3], alone(found, NAME, arguments))


def test_a_node_that_is_not_finite_is_among_those_that_are_named(kernel):
    found = zoo.model("m1_n1")
    task, arrays, arguments = task_of(found, 21)
    arrays[0][13, 5] = np.nan
    work, failed = np.zeros(found.batch_library.work[NAME]), ctypes.c_size_t()
    address = ctypes.c_void_p(found.batch_library.address(NAME))
    place = ctypes.c_void_p(work.ctypes.data)
    status = kernel.together(address, ctypes.byref(task), place, ctypes.byref(failed))
    assert status == NOT_FINITE and failed.value == 8
    first = evaluated(found, NAME, given(found, arguments, NAME, slice(8)))
    np.testing.assert_allclose(arrays[3][:8], first, rtol=1e-9, atol=1e-9)
    assert not arrays[3][8:].any()


def test_a_function_without_batches_has_no_address():
    with pytest.raises(KeyError):
        zoo.model("m1_n1").batch_library.address("momentum")
