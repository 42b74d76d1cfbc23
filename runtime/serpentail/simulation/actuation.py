"""What acts in a run: controllers and legs go in; the C interface's record of them and times to
stop at come out.
"""

import ctypes

import numpy as np

from ..errors import SimulationError
from .controllers import Controller, NativeTorque, Parts, parts_of, phases_of
from .piecewise import Piecewise
from .records import Records


class Actuation:
    """Controllers and legs as the C interface takes them; ``error`` keeps what a function of the
    user's raised.
    """

    def __init__(self, records: Records, controller: Controller, legs: Piecewise | None = None):
        self.records, self.model, self.error = records, records.model, None
        self.nt = self.model.layout.nt
        self.float_errors = np.geterr()  # the user's: SciPy's methods work with their own
        pairs = [
            (begin, self._own(parts_of(each, self.nt))) for begin, each in phases_of(controller)
        ]
        self.parts = [parts for _, parts in pairs]
        self.legs = legs
        stops = {*self._kinks(pairs), *([] if legs is None else legs.kinks(2).tolist())}
        self.stops = records.array(sorted(stops))
        begins = records.array([begin for begin, _ in pairs])
        own = {"legs": self._table(legs)} if legs is not None else {}
        self.record = records.record(
            "drive",
            phases=len(pairs),
            begins=begins,
            controllers=records.records(
                "controller", [self._controller(parts) for parts in self.parts]
            ),
            stops=len(self.stops),
            stop_times=self.stops,
            **own,
        )

    def _own(self, parts: Parts) -> Parts:
        """Return the parts as this model has them: PFL as a function of Python where its C is
        missing.
        """
        if parts.pfl is None or self.records.has("controller", "reference"):
            return parts
        return Parts(user=parts.pfl)

    @staticmethod
    def _kinks(pairs) -> list[float]:
        """Times at which phases begin, and at which what acts in them is not smooth."""
        begins = [begin for begin, _ in pairs]
        found = begins[1:]
        for (begin, parts), end in zip(pairs, [*begins[1:], np.inf], strict=True):
            found += [t for t in parts.kinks() if t < end and (t > begin or begin == begins[0])]
        return found

    def _controller(self, parts: Parts) -> ctypes.Structure:
        members = {}
        if parts.damping is not None:
            members["damping"] = self.records.array(parts.damping)
        if parts.torques is not None:
            members["torques"] = self._table(parts.torques)
        if parts.pfl is not None:
            law = parts.pfl
            members |= {"reference": self._table(law.curve), "kp": law.kp, "kd": law.kd}
            members["feedforward"] = law.feedforward
        if parts.native is not None:
            members |= _native(parts.native)
        if parts.user is not None:
            members["function"] = self._callback(parts.user)
        return self.records.record("controller", **members)

    def _table(self, curve: Piecewise) -> ctypes.Structure:
        pieces, channels, powers = curve.coefficients.shape
        arrays = {
            name: self.records.array(getattr(curve, name)) for name in ("times", "coefficients")
        }
        return self.records.record(
            "piecewise", pieces=pieces, channels=channels, degree=powers - 1, **arrays
        )

    def _callback(self, user):
        """Return a C function that calls the user's; what that raises is kept, and ends the run."""
        real, pointer = self.records.real, ctypes.POINTER(self.records.real)
        prototype = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, real, pointer, pointer, pointer)

        def call(_context, t, q, v, tau):
            try:
                np.ctypeslib.as_array(tau, (self.nt,))[:] = self._user_torque(user, t, q, v)
            except BaseException as error:
                self.error = error
                return 1
            return 0

        function = prototype(call)
        self.records.kept.append(function)
        return function

    def _user_torque(self, user, t: float, q, v) -> np.ndarray:
        """Torques of the user's function; what is no state any more gives none, which ends the
        step.
        """
        q, v = (
            np.ctypeslib.as_array(a, (n,)).copy()
            for a, n in ((q, self.model.nq), (v, self.model.nv))
        )
        if not (np.isfinite(q).all() and np.isfinite(v).all()):
            return np.full(self.nt, np.nan)
        with np.errstate(**self.float_errors):
            result = np.asarray(user(t, q, v), float)
        if result.shape != (self.nt,) or not np.isfinite(result).all():
            raise SimulationError(
                f"the controller gave {result!r} at t = {t:.6g} s, not {self.nt} finite torques"
            )
        return result


def _native(law: NativeTorque) -> dict:
    """Return the members of a compiled function and its context."""
    native = isinstance(law.function, ctypes._CFuncPtr)
    function = ctypes.cast(law.function, ctypes.c_void_p).value if native else law.function
    if not isinstance(function, int) or function <= 0 or not isinstance(law.context, int | None):
        raise SimulationError(
            f"NativeTorque: {law!r}: give a ctypes function or an address, and an address or None"
        )
    return {"function": function, "context": law.context}
