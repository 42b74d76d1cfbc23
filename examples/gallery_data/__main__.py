"""Computes what published animals and robots do, and prints it beside what was measured.

NAMES make only some: gecko yaw. All together also write the table of docs/measurements.md. Pages
that move go to output/gallery_data. It takes about two minutes.
"""

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path

from examples import front

FOLDER = front.ROOT / "output" / "gallery_data"
PUBLISHED = Path(__file__).with_name("published.toml")
PAGE = front.ROOT / "docs" / "measurements.md"
SYSTEMS = dict.fromkeys(("template", "tailbot", "squirrel", "gecko", "joints", "yaw"), "systems")
SYSTEMS |= dict.fromkeys(("cheetah", "minitaur", "load_cell"), "forces")  # where they are computed


def main(names: list[str], folder: Path) -> int:
    """Compute the named systems, or all, and print them."""
    from examples.paper import page, published

    items = published.read(PUBLISHED)
    values = computed(folder, names or SYSTEMS)
    print("\n".join(page.lines({name: items[name] for name in names or items}, values)))
    if not names:
        page.write(items, values, PAGE)
        print(f"\nwritten: {PAGE}")
    print(f"pages that move: {folder}")
    return 0


def computed(folder: Path, names: Iterable[str] = SYSTEMS) -> dict[str, dict]:
    """Return the values of systems by row; write their pages that move."""
    folder.mkdir(parents=True, exist_ok=True)
    rooms = {name: import_module(f"examples.gallery_data.{SYSTEMS[name]}") for name in names}
    return {name: getattr(room, name)(folder) for name, room in rooms.items()}


if __name__ == "__main__":
    parser = front.parser(__doc__)
    systems = front.one_of(SYSTEMS)
    parser.add_argument("names", nargs="*", metavar="NAME", type=systems, help="gecko, yaw")
    front.run(main, parser.parse_args().names, FOLDER)
