"""Computes the figures and tables of the paper again, and prints them beside its own numbers.

Y. Liu, P. Ben-Tzvi, "How a serpentine tail assists agile motions of kangaroo rats", 2023: Figs. 6
to 15, Tables 1 and 2. NAMES make only some: fig8 table2. All together also write the table of
docs/paper.md. Pictures and pages that move go to output/paper. What is computed is kept there: an
interrupted run resumes.
"""

from functools import partial
from pathlib import Path

from examples import front

FOLDER = front.ROOT / "output" / "paper"
# the module and function of each part, its files, its figures and tables; the longest first
PARTS = {
    "segments": ("plans", ("fig12.html", "fig13.png"), ("fig12", "fig13", "table2")),
    "recovery": ("ground", ("fig15.html",), ("fig15",)),
    "nodes": ("plans", ("fig11.html", "fig11.png"), ("fig11",)),
    "jump": ("flights", ("fig9.html", "fig10.png"), ("fig6", "fig9", "fig10")),
    "support": ("ground", ("fig14.html",), ("fig14",)),
    "swing": ("swing", ("fig8.html", "fig8.png"), ("fig7", "fig8")),
    "table_1": ("ground", (), ("table1",)),
}
COMPUTE = ("collocation", "figures", "flights", "ground", "plans", "swing", "truth")
SOURCES = (
    "runtime",
    "codegen",
    "examples/righting.py",
    *(f"examples/paper/{x}.py" for x in COMPUTE),
)


def main(names: list[str], folder: Path) -> int:
    """Compute the parts of the named figures and tables, and print them; all, if none is named."""
    from examples.paper import page, published

    items = published.read()
    values = computed(folder, set(names or items))
    chosen = {name: items[name] for name in items if name in values}
    print("\n".join(page.lines(chosen, values)))
    if chosen == items:
        page.write(items, values)
        print(f"\nwritten: {page.PAGE}")
    print(f"pictures and pages that move: {folder}")
    return 0


def computed(folder: Path, names: set[str]) -> dict[str, dict]:
    """Return the values of figures and tables, by row; parts that FOLDER has are not made again."""
    from importlib import import_module

    from examples.studies.parts import Part, digest, made

    sources = [front.ROOT / source for source in SOURCES]
    sources += [Path(__file__).with_name(f"{module}.py") for module in COMPUTE]
    of, parts = {"program": digest(*sources)}, {}
    of["scenes"] = [path.read_text("utf-8") for path in sorted((front.ROOT / "scenes").iterdir())]
    for title, (module, files, figures) in PARTS.items():
        if names & set(figures):
            make = getattr(import_module(f"examples.paper.{module}"), title)
            parts[title] = Part(partial(make, folder), of, tuple(folder / file for file in files))
    folder.mkdir(parents=True, exist_ok=True)
    found = made("paper", folder / "parts", parts)
    return {name: rows for part in found.values() for name, rows in part.items() if name in names}


if __name__ == "__main__":
    parser = front.parser(__doc__)
    figures = front.one_of([name for _, _, names in PARTS.values() for name in names])
    parser.add_argument("names", nargs="*", metavar="NAME", type=figures, help="fig8, table2")
    front.run(main, parser.parse_args().names, FOLDER, after=front.GOES_ON)
