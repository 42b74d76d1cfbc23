"""Compiled functions, called with NumPy arrays: one state, a batch, or the samples of runs."""

import ctypes
import math
import threading
from collections.abc import Sequence
from functools import partial
from typing import Any, NoReturn

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike, DTypeLike

from serpentail_scene.layout import QUATERNION

from ..basics.checks import real_array, refuse_not_finite
from ..basics.errors import StateError
from ..compiling.threads import shared
from .chains import bend_ranges, layout_of
from .fast_call import Call, fast_call, no_call
from .library import NOT_POSITIVE_DEFINITE, OUT_OF_RANGE, BatchLibrary, RecordFunction
from .memory import Out, address_of, aligned, aligned_rows, received

MOST_ARRAYS = 10
# numbers in a function's arrays; above, calls are so long that other threads should run meanwhile
MOST_UNDER_LOCK = 8192
QUATERNIONS = {"q": QUATERNION, "x": slice(0, 4)}  # where they are, by the first argument's name
Arrays = Sequence[ndarray]
Shapes = Sequence[tuple[int, ...]]


class ArgumentRecord(ctypes.Structure):
    """The argument record of a function of the generated C."""

    _fields_ = (
        ("parameters", ctypes.c_void_p),
        ("count", ctypes.c_size_t),
        ("failed", ctypes.c_size_t),
        ("work", ctypes.c_void_p),
        ("arrays", ctypes.c_void_p * MOST_ARRAYS),
    )


def argument_record(
    parameters: ndarray, count: int, work: ndarray, arrays: Arrays
) -> ArgumentRecord:
    """Return a record of arrays, which the caller keeps alive."""
    addresses = (ctypes.c_void_p * MOST_ARRAYS)(*map(address_of, arrays))
    return ArgumentRecord(address_of(parameters), count, 0, address_of(work), addresses)


class Buffers:
    """Arrays that are passed to C; they are kept, so that a call on one state is cheap."""

    def __init__(
        self, dtype: DTypeLike, inputs: Shapes, outputs: Shapes, work: int, parameters: ndarray
    ):
        self.inputs = [np.zeros(shape, dtype) for shape in inputs]
        self.outputs = [np.zeros(shape, dtype) for shape in outputs]
        self.only = self.outputs[0] if len(self.outputs) == 1 else None
        self.work, self.parameters = aligned(work, dtype), parameters
        self.record = argument_record(parameters, 1, self.work, (*self.inputs, *self.outputs))
        self.address = ctypes.addressof(self.record)

    def results(self) -> tuple[Any, ...]:
        """Return fresh copies of the outputs; a scalar as a number."""
        return tuple(o[()] if o.ndim == 0 else o.copy() for o in self.outputs)


class RunKernel:
    """A compiled function on the samples of many runs, each with its own parameters.

    parameters (runs, scalars); inputs and outputs (runs, samples, ...), of the model's number type.
    Their addresses are looked up once. For one thread.
    """

    def __init__(self, kernel: "Kernel", parameters: ndarray, inputs: Arrays, outputs: Arrays):
        self.kernel, self.inputs = kernel, inputs
        self.places = [(address_of(a), *a.strides[:2]) for a in (*inputs, *outputs)]
        self.parameters = address_of(parameters), parameters.strides[0]
        self.work = aligned(kernel.work, kernel.dtype)
        self.record = argument_record(parameters, 0, self.work, (*inputs, *outputs))
        self.address = ctypes.addressof(self.record)

    def __call__(self, run: int, rows: int, begin: int = 0) -> None:
        """Evaluate ``rows`` rows of a run; a StateError counts rows from the first run's on."""
        record = self.record
        record.parameters, record.count = self.parameters[0] + run * self.parameters[1], rows
        for k, (first, apart, row) in enumerate(self.places):
            record.arrays[k] = first + run * apart + begin * row
        if status := self.kernel.function(self.address):
            whole = [a.reshape(-1, *a.shape[2:]) for a in self.inputs]
            failed = run * self.inputs[0].shape[1] + begin + record.failed
            self.kernel.fail(status, failed, whole)


class Kernel:
    """One compiled function of a model: single states, or arrays with a leading batch axis."""

    def __init__(
        self,
        library: ctypes.CDLL,
        batch_library: BatchLibrary,
        manifest: dict,
        name: str,
        parameters: ndarray,
    ):
        self.batch_library = batch_library
        entry = manifest["functions"][name]
        self.name, self.dtype = name, parameters.dtype
        self.names = [a["name"] for a in entry["inputs"]]
        self.shapes = [tuple(a["shape"]) for a in entry["inputs"]]
        self.out_shapes = [() if a["shape"] == [1] else tuple(a["shape"]) for a in entry["outputs"]]
        self.function = getattr(library, f"{manifest['prefix']}_batch_{name}")
        self.function.argtypes = [ctypes.c_void_p]
        self.parameters, self.work = parameters, manifest["work"][name]
        self.bend_ranges = bend_ranges(manifest)
        self.polar = manifest["scene"]["coordinates"] == "polar"
        self.kinds = manifest["dimensions"].get("kinds") or ("continuum",)  # of all: arcs alone
        self.manifest = manifest
        self.thread = threading.local()  # buffers of each thread
        self.fast: Call | None = None  # made at the first call

    def __call__(self, *arrays: ArrayLike, out: Out = None) -> Any:
        """Return the output, or a tuple of outputs; StateError names an argument that is wrong.

        out: an array, or a sequence of arrays, which receive the outputs and are returned.
        """
        outputs = (self.fast or self._prepared())(*arrays) if out is None else None
        return self._by_ctypes(arrays, out) if outputs is None else outputs

    def _prepared(self) -> Call:
        """Return a fast call of the function; it returns None for arguments that it declines."""
        buffers = self._buffers()
        size = self.work + sum(array.size for array in (*buffers.inputs, *buffers.outputs))
        if size > MOST_UNDER_LOCK:
            self.fast = no_call
        else:
            self.fast = fast_call(
                self.function, buffers.address, buffers.inputs, buffers.outputs, buffers
            )
        return self.fast

    def _buffers(self) -> Buffers:
        """Return buffers of our own."""
        return Buffers(self.dtype, self.shapes, self.out_shapes, self.work, self.parameters)

    def _by_ctypes(self, arrays: Sequence[ArrayLike], out: Out) -> Any:
        """Return outputs for any arguments."""
        if len(arrays) != len(self.names):
            raise TypeError(f"{self.name} takes {', '.join(self.names)}")
        dtype = self.dtype
        if out is not None:
            return self._any(arrays, out)
        for array, shape in zip(arrays, self.shapes):  # noqa: B905  counted above: strict costs 0.2 us
            if type(array) is not ndarray or array.shape != shape or array.dtype is not dtype:
                return self._any(arrays, None)
        return self._one(arrays)

    def _one(self, arrays: Sequence[Any]) -> Any:
        """Return outputs for arrays of one state; other threads run while C does."""
        try:
            buffers = self.thread.buffers
        except AttributeError:  # this thread's first call
            buffers = self.thread.buffers = self._buffers()
        for array, buffer in zip(arrays, buffers.inputs):  # noqa: B905  as above
            buffer[:] = array
        if status := self.function(buffers.address):
            self.fail(status, 0, [b[None] for b in buffers.inputs])
        return buffers.only.copy() if buffers.only is not None else buffers.results()

    def _any(self, values: Sequence[ArrayLike], out: Out) -> Any:
        """Return outputs for any arrays of numbers, some of which may have a batch axis."""
        arguments = zip(self.names, self.shapes, values, strict=True)
        arrays = [self._checked(name, shape, value) for name, shape, value in arguments]
        # sizes of the batches among them
        dimensions = zip(arrays, self.shapes, strict=True)
        counts = {array.shape[0] for array, shape in dimensions if array.ndim > len(shape)}
        if not counts and out is None:
            return self._one(arrays)
        if len(counts) > 1:
            raise StateError(
                f"{self.name}: batch sizes differ ({', '.join(map(str, sorted(counts)))}): give "
                "one size"
            )
        shapes = [(*counts, *shape) for shape in self.out_shapes]
        if out is None:
            outputs = [aligned_rows(shape, self.dtype) for shape in shapes]
        else:
            outputs = received(f"{self.name}: out", out, shapes, self.dtype, arrays)
        self._batch(counts.pop() if counts else 1, arrays, outputs)
        return outputs[0] if len(outputs) == 1 else tuple(outputs)

    def _checked(self, name: str, shape: tuple[int, ...], value: ArrayLike) -> ndarray:
        """Return an argument as an array of the shape, or with a batch axis before it."""
        array = real_array(f"{self.name}: {name}", value, StateError, self.dtype)
        if array.shape != shape and (array.ndim == 0 or array.shape[1:] != shape):
            size = ", ".join(map(str, shape))
            raise StateError(
                f"{self.name}: {name} has shape {array.shape}, not ({size},) or (batch, {size})"
            )
        return array

    def _batch(self, count: int, arrays: Arrays, outputs: Arrays) -> None:
        """Evaluate a batch; single states are repeated."""
        whole = [
            a if a.ndim > len(shape) else np.ascontiguousarray(np.broadcast_to(a, (count, *shape)))
            for a, shape in zip(arrays, self.shapes, strict=True)
        ]
        rows = [a.reshape(count, *shape) for a, shape in zip(outputs, self.out_shapes, strict=True)]
        function = self.batch_library.entry(self.name, count)
        run = self._each if function is None else partial(self._side_by_side, function)
        shared(count, self.batch_library.threads, partial(run, whole, rows))

    def _each(self, inputs: Arrays, outputs: Arrays, first: int, last: int) -> None:
        """Evaluate states [first, last) one by one."""
        work = aligned(self.work, self.dtype)
        record = argument_record(
            self.parameters, last - first, work, [a[first:last] for a in (*inputs, *outputs)]
        )
        if status := self.function(ctypes.addressof(record)):
            self.fail(status, first + record.failed, inputs)

    def _side_by_side(
        self, function: RecordFunction, inputs: Arrays, outputs: Arrays, first: int, last: int
    ) -> None:
        """Evaluate states [first, last) in lanes; lanes among which one fails again, one by one."""
        work = aligned(self.batch_library.work[self.name], self.dtype)
        while first < last:
            record = argument_record(
                self.parameters, last - first, work, [a[first:last] for a in (*inputs, *outputs)]
            )
            if not function(ctypes.addressof(record)):
                return
            first += record.failed
            after = min(first + self.batch_library.states, last)
            self._each(inputs, outputs, first, after)
            first = after

    def fail(self, status: int, index: int, arrays: Arrays) -> NoReturn:
        """Raise the error that a status means for one state of the arrays."""
        # an argument that is not finite, or a quaternion without direction
        state = f" of state {index}" if len(arrays[0]) > 1 else ""
        for name, array in zip(self.names, arrays, strict=True):
            refuse_not_finite(f"{self.name}: {name}", array[index], StateError, state)
        q = arrays[0][index].astype(float)
        if self.names[0] in QUATERNIONS:
            self._check_attitude(q, state)
        # otherwise the error of the C function
        if status == OUT_OF_RANGE:
            raise StateError(f"{self.name}: {self._out_of_range(q, state)}")
        indefinite = f"the inertia matrix{state} is not positive definite"
        what = indefinite if status == NOT_POSITIVE_DEFINITE else f"the result{state} is not finite"
        raise StateError(f"{self.name}: {what}: is a value too large, or a parameter unphysical?")

    def _check_attitude(self, q: ndarray, state: str) -> None:
        """Refuse a quaternion that gives no attitude."""
        limits, name = np.finfo(self.dtype), self.names[0]
        where = QUATERNIONS[name]
        norm = math.hypot(*q[where])
        if not limits.tiny <= norm * norm <= limits.max:
            words = f"has norm {norm:.3g}" if norm else "is zero"
            place = f"{name}[{where.start}:{where.stop}]"
            raise StateError(
                f"{self.name}: the quaternion {place}{state} {words}: upright is (1, 0, 0, 0)"
            )

    def _out_of_range(self, q: ndarray, state: str) -> str:
        """Return which segment is bent beyond the model's range, and the remedy."""
        tail = q[QUATERNIONS[self.names[0]].stop :]
        if self.names[0] == "x":  # the rates are there, too
            tail = tail[: len(tail) // 2]
        kinds = np.broadcast_to(self.kinds, self.bend_ranges.shape)
        widths = np.array(layout_of(self.manifest, tuple(kinds)).widths)
        arcs = (kinds == "continuum") & (widths > 0)
        firsts = (widths.cumsum() - widths)[arcs]
        first, second = tail[firsts], tail[firsts + 1]
        bends = np.zeros(len(arcs))  # only arcs have a range
        bends[arcs] = abs(second) if self.polar else np.hypot(first, second)
        least, worst = int(bends.argmin()), int((bends / self.bend_ranges).argmax())
        if self.polar and bends[worst] <= self.bend_ranges[worst]:
            what = f"segment {least + 1}{state} has theta = {bends[least]:.6g} rad"
            return (
                f"{what}: polar coordinates have no value at theta = 0; use "
                f'coordinates = "bend" in the scene'
            )
        return (
            f"segment {worst + 1}{state} is bent by {bends[worst]:.6g} rad, beyond the scene's "
            f"{self.bend_ranges[worst]:.6g}: set a larger `bend_range`, then generate the model "
            "again"
        )
