"""What papers say, and the pages of it: each row has its band, its place and its verdict."""

import math

import pytest

import serpentail as st
from examples.gallery_data import __main__ as gallery
from examples.paper import __main__ as command
from examples.paper import page, published
from examples.paper.published import INCOMPARABLE, INSIDE, OUTSIDE, Row
from tests.support.rows import row

ITEMS = published.read()
FIGURES = {f"fig{k}" for k in range(6, 16)} | {"table1", "table2"}
VERDICTS = {INSIDE: INSIDE, page.RED: OUTSIDE, INCOMPARABLE: INCOMPARABLE}
TABLES = {page.PAGE: ITEMS, gallery.PAGE: published.read(gallery.PUBLISHED)}


def on_page(path=page.PAGE):
    """Cells of each row of a page's table, below the rows of titles."""
    begin, end = page.marks(path)
    text = path.read_text("utf-8").split(begin)[1].split(end)[0]
    lines = [line[2:-2].split(" | ") for line in text.splitlines()[2:]]
    return [[cell.strip() for cell in cells] for cells in lines if not cells[0].startswith("**")]


def rows(items=ITEMS):
    return [(name, each) for name, item in items.items() for each in item.rows]


def test_the_data_have_every_figure_and_every_part_of_the_command():
    assert set(ITEMS) == FIGURES
    assert sorted(name for _, _, made in command.PARTS.values() for name in made) == sorted(FIGURES)
    files = {file for _, files, _ in command.PARTS.values() for file in files}
    assert {item.page for item in ITEMS.values()} <= files
    numbers = {each.value for _, each in rows()}
    energies, power = {0.0165, 0.0308, 0.0152, 0.0208}, {0.2699, 1.02, 0.208, 0.551}
    iterations, minutes, errors = {364, 646, 1469}, {15, 39, 121}, {3.98, 8.21, 19.5}
    assert energies | power | iterations | minutes | errors | {0.6, 1.08} <= numbers


def test_verdicts_are_those_of_the_band():
    band = Row("x", "x", 2.0, "m", (1.0, 4.0))
    reason = Row("x", "x", 2.0, "m", incomparable="no state")
    sentence = Row("x", "x", True)
    for of, value, verdict in (
        (band, 1.0, INSIDE),
        (band, 4.0 + 1e-12, INSIDE),
        (band, 0.999, OUTSIDE),
        (band, 4.001, OUTSIDE),
        (band, math.nan, OUTSIDE),
        (reason, 9.0, INCOMPARABLE),
        (sentence, True, INSIDE),
        (sentence, False, OUTSIDE),
    ):
        with row(of, value):
            assert of.verdict(value) == verdict


def test_wrong_data_are_refused(tmp_path):
    good = '{ name = "a", says = "b", value = 1, unit = "m", band = [0.5, 2] }'
    head = '[fig6]\ntitle = "t"\nwhere = "w"\npage = "p"\nrows = ['
    words = good.replace("value = 1", "value = 'x'")
    path = tmp_path / "published.toml"
    path.write_text(f"{head}{good}]")
    assert published.read(path)["fig6"].rows[0].band == [0.5, 2]
    for name, text, field in (
        ("no rows", head.replace("rows = [", ""), "fig6: value"),
        ("one name twice", f"{head}{good}, {good}]", r"fig6.rows: value \['a', 'a'\]"),
        ("a key", f"{head}{good.replace('says', 'say')}]", r"fig6.rows\[0\]: value"),
        ("outside", f"{head}{good.replace('0.5', '1.5')}]", r"rows\[0\].band: value \[1.5, 2\]"),
        ("one end", f"{head}{good.replace('0.5, 2', '0.5')}]", r"rows\[0\].band: value \[0.5\]"),
        ("no band", f"{head}{good.replace(', band = [0.5, 2]', '')}]", "band or incomparable"),
        ("no unit", f"{head}{good.replace('unit', 'why')}]", "band or incomparable"),
        ("both", f"{head}{good.replace('unit', 'incomparable')}]", "true alone"),
        ("a text", f"{head}{words}]", "a text and incomparable"),
        ("a sentence", f"{head}{good.replace('value = 1', 'value = true')}]", "true alone"),
    ):
        path.write_text(text)
        with row(name), pytest.raises(st.SerpentailError, match=field):
            published.read(path)


def test_each_row_of_a_page_has_its_row_in_the_data_and_the_verdict_of_its_number():
    for path, items in TABLES.items():
        found = on_page(path)
        assert len(found) == len(rows(items))
        for cells, (name, each) in zip(found, rows(items), strict=True):
            with row(name, each.name):
                assert cells[:2] == page.claim(each) and cells[4] == page.band(each)
                sentence = each.value is True
                ours = cells[2] == "yes" if sentence else float((cells[2] or "nan").split()[0])
                assert VERDICTS[cells[3]] == each.verdict(ours)
                assert VERDICTS[cells[3]] != OUTSIDE or each.why  # what is known of the reason


@pytest.mark.slow
def test_the_command_finds_what_the_page_tells(tmp_path):
    values = command.computed(tmp_path, FIGURES)
    for cells, (name, each) in zip(on_page(), rows(), strict=True):
        value = values[name][each.name]
        with row(name, each.name, value):
            ours = value[0] if isinstance(value, list) else value
            assert each.verdict(ours) == VERDICTS[cells[3]]
    for _, files, _ in command.PARTS.values():
        assert all((tmp_path / file).stat().st_size > 1000 for file in files)


@pytest.mark.slow
def test_each_animal_and_robot_does_what_the_page_tells(tmp_path):
    values = gallery.computed(tmp_path)
    items = TABLES[gallery.PAGE]
    assert set(values) == set(gallery.SYSTEMS) <= set(items)
    for cells, (name, each) in zip(on_page(gallery.PAGE), rows(items), strict=True):
        if (ours := values.get(name, {}).get(each.name)) is None:
            assert each.incomparable and not cells[2]
            continue
        with row(name, each.name, ours):
            assert each.verdict(ours) == VERDICTS[cells[3]]
            if each.value is not True and not each.incomparable:
                assert ours == pytest.approx(float(cells[2].split()[0]), rel=1e-3)
    for name in gallery.SYSTEMS:
        assert not (file := items[name].page) or (tmp_path / file).stat().st_size > 1000
