"""The problems of a scene, collected so that its author can correct all of them at once."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from serpentail_scene.messages import did_you_mean, one_line, shown

LONGEST = 80  # characters of a field or a value in a line


@dataclass(frozen=True)
class Problem:
    """One problem: its place, the value there (None: nothing), and what to do."""

    field: str
    value: object
    remedy: str

    def __str__(self) -> str:
        text = f"value {shown(self.value, LONGEST)}"
        if self.value is None:
            text = "no value"
        elif isinstance(self.value, bool):
            text = f"value {self.value}".lower()  # as TOML writes it
        return f"{one_line(self.field, LONGEST)}: {text}: {self.remedy}"


class SceneError(ValueError):
    """A scene that cannot be used: its `problems`, one line of text for each."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


def suggest(word: object, names: Collection[str]) -> str:
    """Return "did you mean ...?", or the list of all names."""
    return did_you_mean(word, names) or f"known: {', '.join(names)}"
