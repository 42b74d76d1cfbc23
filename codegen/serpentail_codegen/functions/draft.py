"""A function that is being assembled: a builder that knows the tail, and checks the inputs of each
step.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from serpentail_scene.parameters import NAMED, Parameter, name_in
from serpentail_scene.signatures.table import SIGNATURES

from ..ir import dataflow
from ..ir.builder import Builder, narrowed
from ..ir.program import Array, Index, Program, Ref
from ..ir.step import Step, specialised
from ..ir.tape import Number
from ..mechanics import rotations, torso, translation
from ..mechanics.lower import declared_shapes, derive, derived
from ..scene.variant import Stretch
from .layout import block
from .scope import Instead, Scope, State, Vectors
from .tail import Tail

AT_REST = ("identity", "still", "zero_1", "zero_3")  # constants that have one value by each name
OF_CHAINS = tuple(p.name for p in NAMED if p.of_chain)
SLOPED = {  # where gravity has any direction
    rotations.world_acceleration: rotations.world_acceleration_sloped,
    torso.potential_energy: torso.potential_energy_sloped,
    torso.torso_acceleration: torso.torso_acceleration_sloped,
    translation.base_acceleration: translation.base_acceleration_sloped,
}
Reads = Scope | Mapping[str, Ref]


@dataclass(kw_only=True)
class Draft(Builder):
    """A function that is being assembled: the builder, the sizes of the tail, and the parameters of
    the model.

    ``dynamics``: "composite" forms H column by column; "lanes" computes its columns in lanes, of an
    articulated tail; "segments" computes v_dot without H if no other result needs H.
    """

    tail: Tail  # the whole animal, or the chain that the draft stands on
    dynamics: str = "composite"
    parameters: Mapping[str, Ref] = field(default_factory=dict, init=False)
    mounts: dict[str, Ref] = field(default_factory=dict, init=False)  # axes there, by their owner
    stretch: Stretch | None = field(
        default=None, init=False
    )  # the stretch whose segments the open loop is over
    _lanes: tuple[int, str] = field(default=(0, ""), init=False)  # and suffix, of local vectors

    def declare_parameters(self, parameters: Iterable[Parameter]) -> None:
        """Declare the parameter struct: steps find its numbers by their names."""
        refs = {p.name: self.array(p.name, p.size, role="parameters")[0] for p in parameters}
        if self.tail.fixed:  # a base without mass, so that the steps of the torso serve it, too
            refs |= {"torso_mass": self.zero(1), "torso_inertia": self.zero(3)}
        self.parameters = MappingProxyType(refs)

    @property
    def gravity(self) -> tuple[str, int]:
        """Name and size of the parameter that says where things fall."""
        return ("gravity_vector", 3) if self.tail.shape.sloped else ("gravity", 1)

    def on(self, chain: Tail) -> AbstractContextManager[None]:
        """Stand on one chain: with its sizes, and its parameters under the names of the tail's; its
        name ends those of local arrays.
        """
        return self._standing(chain) if self.tail.branches else nullcontext()

    @contextmanager
    def _standing(self, chain: Tail) -> Iterator[None]:
        before, refs = (self.tail, self.parameters), self.parameters
        names = {name_in(chain.owner, name): name for name in OF_CHAINS}
        own = {name: refs[of_all] for of_all, name in names.items() if of_all in refs}
        others = {name: ref for name, ref in refs.items() if name not in OF_CHAINS}
        self.tail, self.parameters = chain, MappingProxyType(others | own)
        yield
        self.tail, self.parameters = before

    def declare(self, array: Array) -> Array:
        """Declare an array; names of a chain's own end with its name."""
        return super().declare(replace(array, name=self.own(array.name)))

    def own(self, name: str) -> str:
        """Return a name with that of the chain that the draft stands on."""
        return f"{name}_of_{self.tail.name}" if self.tail.name else name

    def state(self, q: Array, v: Array | None = None) -> State:
        """Return a state; leave out the velocity if it is not used."""
        still = self.zero(3) if self.tail.fixed else None
        return State(self.tail, q, v, still, self.given.get("given"))

    @property
    def given(self) -> dict[str, Array]:
        """The argument that tells how prescribed joints move, by its name; empty without one."""
        return {a.name: a for a in self.arrays if a.name == "given"}

    def of_torso(self, array: Array, part: slice) -> Ref:
        """Return the torso's part of a velocity or an acceleration, zeros on a fixed base."""
        return self.zero(3) if self.tail.fixed else block(array, part)

    def entry(self, name: str, k: Index, size: int) -> Ref:
        """Return the numbers of piece k, for a parameter with numbers for each piece."""
        return self.parameters[name].array.part(size * k, size)

    def step(self, function: Callable[..., dict] | Step, *reads: Reads, **writes: Ref) -> None:
        """Apply a step, or the one derived from a function of mechanics.

        Parameters are found by their names, all other inputs are passed. From a scope the step
        takes the vectors that it declares; from a plain dictionary it must read all.
        """
        if self.tail.shape.sloped and not isinstance(function, Step):
            function = SLOPED.get(function, function)
        step = derived(function)
        if step.name in SIGNATURES:  # the CasADi module defines both, and would keep only one
            raise ValueError(
                f"{step.name} in {self.name}: a step has the name of an emitted function: rename it"
            )
        if self.tail.shape.weightless and ("gravity", 1) in step.inputs:
            function = step = specialised(step, f"{step.name}_weightless", gravity=(0,))
        declared = set(dict(step.inputs) if function is step else declared_shapes(function))
        refs = self._refs(step.name, declared, reads)

        if self.tail.fixed:
            step = _folded(step, refs)

        # a declared input may be missing if only unwanted outputs need it
        wanted = narrowed(step, {name.rstrip("_") for name in writes})
        for name, _ in wanted.inputs:
            if name not in refs:
                raise ValueError(f"{step.name} in {self.name}: nothing gives {name}")
        for name, ref in writes.items():
            if ref.array.role == "parameters":
                raise ValueError(
                    f"{step.name} in {self.name}: {name} would overwrite the parameter "
                    f"{ref.array.name}"
                )
        self.apply(step, refs, **writes)

    def of_segment(self, function: Callable[..., dict]) -> Step:
        """Return a step that reads what belongs to all coordinates of a segment, for the chain that
        the draft stands on.
        """
        return derive(function, **{"one_coordinate": True} if self.tail.width == 1 else {})

    def _refs(self, step: str, declared: set[str], reads: Iterable[Reads]) -> dict[str, Ref]:
        """Return what a step reads by name; refuse unknown names, repeated ones and parameters."""
        refs: dict[str, Ref] = {}
        for source in reads:
            instead = isinstance(source, Instead)
            offered = isinstance(source, Scope) and not instead
            for name in declared.intersection(source.keys()) if offered else source.keys():
                problem = ""
                if name not in declared:
                    problem = f"it does not read {name}"
                elif name in refs:
                    problem = f"{name} is given twice"
                elif instead and name not in self.parameters:
                    problem = f"{name} is no parameter"
                elif name in self.parameters and not instead:
                    problem = f"{name} is a parameter"
                if problem:
                    raise ValueError(f"{step} in {self.name}: {problem}")
                refs[name] = source[name]
        parameters = {name: ref for name, ref in self.parameters.items() if name in declared}
        return parameters | refs

    @contextmanager
    def side_by_side(self, lanes: int, suffix: str) -> Iterator[None]:
        """Give so many lanes to local vectors that are declared here, and a suffix to their
        names.
        """
        self._lanes, before = (lanes, suffix), self._lanes
        yield
        self._lanes = before

    def store(self, function: Callable[..., dict] | Step, *reads: Reads, **sizes: int) -> Vectors:
        """Apply a step and return its outputs, new local vectors of the same names."""
        outputs = {name: self.vector(name, size) for name, size in sizes.items()}
        self.step(function, *reads, **outputs)
        return Vectors(outputs)

    def vector(self, name: str, size: int) -> Ref:
        """Declare a local vector."""
        lanes, suffix = self._lanes
        return self.declare(Array(name + suffix, "local", size, lanes=lanes))[0]

    def vectors(self, **sizes: int) -> Vectors:
        """Declare local vectors."""
        return Vectors({name: self.vector(name, size) for name, size in sizes.items()})

    def scratch(self, **sizes: int) -> Vectors:
        """Return local vectors that each stretch of segments uses again; they are declared once."""
        found, suffix = {a.name: a[0] for a in self.arrays if a.role == "local"}, self._lanes[1]
        return Vectors(
            {n: found.get(self.own(n + suffix)) or self.vector(n, s) for n, s in sizes.items()}
        )

    def fixed(self, name: str, values: Iterable[Number]) -> Ref:
        """Return a constant, which is declared once."""
        values = tuple(values)
        names = (name, self.own(name))
        same = [a for a in self.arrays if a.name in names and a.role == "constant"]
        found = next((a for a in same if a.values == values), None)
        return (found or self.constant(name, values))[0]

    def zero(self, size: int) -> Ref:
        """Return zeros."""
        return self.fixed(f"zero_{size}", [0] * size)

    def finish(self) -> Program:
        """Return the recorded program; what folded into steps is left out."""
        program = super().finish()
        if not self.tail.fixed:
            return program
        used = dataflow.read_names(program.body)
        kept = (a for a in program.arrays if a.role != "constant" or a.name in used)
        return replace(program, arrays=tuple(kept))


def _folded(step: Step, refs: Mapping[str, Ref]) -> Step:
    """Return a step with what a fixed base keeps constant: its attitude, and all zeros."""
    constants = {
        name: refs[name].array.values
        for name, _ in step.inputs
        if name in refs and refs[name].array.name in AT_REST
    }
    if not constants:
        return step
    return specialised(step, "_".join([step.name, "at_rest", *constants]), **constants)
