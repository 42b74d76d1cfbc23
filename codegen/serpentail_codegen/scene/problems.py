"""The problems of a scene, collected so that its author can correct all of them at once."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from difflib import get_close_matches

# Names that other software uses for the same things: suggested, never accepted.
ALIASES = {
    "crba": "mass_matrix",
    "nle": "bias_force",
    "rnea": "inverse_dynamics",
    "aba": "forward_dynamics",
    "m": "segments",
    "n": "links",
    "tail": "kind",
}


@dataclass(frozen=True)
class Problem:
    """One problem: its place, the value there (None: nothing), and what to do."""

    field: str
    value: object
    remedy: str

    def __str__(self) -> str:
        return f"{one_line(self.field)}: {show(self.value)}: {self.remedy}"


class SceneError(ValueError):
    """A scene that cannot be used: its `problems`, one line of text for each."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


def suggest(word: object, names: Collection[str]) -> str:
    """Return "did you mean ...?", or the list of all names."""
    text = word[:64].lower() if isinstance(word, str) else ""
    near = [ALIASES[text]] if ALIASES.get(text) in names else get_close_matches(text, names, 1)
    return f"did you mean '{near[0]}'?" if near else f"known: {', '.join(names)}"


def show(value: object) -> str:
    """Return "value ..." in the notation of the file."""
    if value is None:
        return "no value"
    try:
        return "value " + one_line(repr(value).lower() if isinstance(value, bool) else repr(value))
    except (ValueError, RecursionError):  # repr refuses integers of more than 4300 digits
        return "value too long to show"


def one_line(text: str) -> str:
    """Return the text on one line of at most 80 characters."""
    line = text if text.isprintable() else repr(text)
    return line if len(line) <= 80 else line[:77] + "..."
