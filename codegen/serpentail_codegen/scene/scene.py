"""The Scene: what to generate."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from serpentail_scene.keys import KEYS
from serpentail_scene.parameters import WIDTHS, Value, parts_of

from .variant import EQUAL, Shape


@dataclass(frozen=True, eq=False)
class Parameters(Mapping[str, Value]):
    """Parameters with values, in the order of PARAMETERS; without link_radius if a scene names
    link_inertia.
    """

    entries: tuple[tuple[str, Value], ...]

    def __getitem__(self, name: str) -> Value:
        return dict(self.entries)[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict(self.entries))

    def __len__(self) -> int:
        return len(self.entries)

    def __hash__(self) -> int:
        return hash(frozenset(self.entries))


def _default(key: str) -> Any:
    """Return the default of a key of scene files."""
    return KEYS[key].default


@dataclass(frozen=True)
class Chain:
    """A chain besides the tail, or a pair of them, whose numbers are those of the right one.

    scene: what its table describes, as if it were a tail; its functions mean nothing. prescribed:
    how its joints move is an input.
    """

    name: str
    pair: bool
    scene: "Scene"
    prescribed: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Return the name of each of its chains, right before left."""
        return (f"{self.name}_right", f"{self.name}_left") if self.pair else (self.name,)


@dataclass(frozen=True)
class Scene:
    """What to generate: a tail, its parameters, the functions, and in which form."""

    name: str  # prefix of every C symbol and generated file
    kind: str
    segments: int  # m
    links: int  # n, in each segment; 1 for a continuum and for mixed tails
    functions: tuple[str, ...]  # in the order of their table
    parameters: Parameters
    # of q_t; "joint": joint angles alpha_i, beta_i; "bend": a_i, b_i; "polar": phi_i, theta_i
    coordinates: str = _default("coordinates")
    samples: int = _default("samples")  # tail points in each segment of a continuum
    bend_range: float = _default("bend_range")  # rad, largest bend of a continuum segment
    baked: bool = _default("baked")  # parameters folded into the code, behind the same ABI
    real: str = _default("real")
    emission: str = _default("emission")
    profile: str = _default("profile")  # or "reproducible": the same bits on every machine
    # groups of points that can touch the ground, in the order of GROUPS
    contacts: tuple[str, ...] = _default("contacts")
    friction: str = _default("friction")
    targets: tuple[str, ...] = _default("targets")  # in the order of TARGETS
    base: str = _default("base")  # or "fixed": the torso never moves
    weightless: bool = _default("weightless")
    shape: Shape = EQUAL  # how segments and links differ
    body: str = ""  # the key `body` of the file, as JSON
    unscaled: Parameters | None = None  # before scaling, if `body` scales the parameters
    size: tuple[float, float, float] = (1.0, 1.0, 1.0)  # factors of kg, m and s
    tables: str = ""  # the keys `segments` and `taper` of the file, as JSON; empty: a count
    chains: tuple[Chain, ...] = ()  # besides the tail
    chain: str = ""  # the tables `chain` of the file, as JSON
    tendon: str = ""  # the tables `tendon` of the file, as JSON

    @property
    def passive(self) -> tuple[str, ...]:
        """Parts of the passive tail that the scene has."""
        return parts_of(self.parameters)

    @property
    def widths(self) -> int:
        """Number of widths of the tail in the air; 0 without air."""
        value = self.parameters.get(WIDTHS, ())
        return len(value) if isinstance(value, tuple) else 1

    @property
    def parts(self) -> dict[str, "Scene"]:
        """Return what describes the tail, and each other chain or pair by its name."""
        return {"": self} | {chain.name: chain.scene for chain in self.chains}
