"""Wrong keys of a scene: all are told at once, each with its field, its value and a remedy; broken
files, which both packages refuse in the same words.
"""

import os
import pickle
from pathlib import Path

import pytest

from serpentail.basics.errors import ModelError
from serpentail.scenes.file import read_scene
from serpentail_codegen.scene.parse import load_scene, scene_for
from serpentail_codegen.scene.problems import Problem, SceneError
from serpentail_codegen.scene.scene import Scene
from tests.support.rows import row
from tests.support.scenes import VALID

NAMES = (
    "", " ", ".", "..", "/", "../elsewhere/t", "a/b", "/etc/t", "a\\b", "C:t", "~", "-t",
    "--output", "_t", "1t", "T", "tA", "t-1", "t.1", "t t", "t\n", "\nt", "t\0", "t;ls", "$(ls)",
    "t\u0131", "\uff54", "math", "stdio", "float", "a" * 64, "a" * 240, "a" * 100_000,
    3, 0, True, 1.5, [], ["t"], {}, {"t": 1}, "rät", "features", "Rat",
)  # fmt: skip
GOOD_NAMES = ("t", "math_", "float1", "t1", "a_b", "a" * 63, "kangaroo_rat_m1_n3")
LINKS, STANCE = 'kind = "articulated"\n', VALID + 'contacts = ["torso", "feet"]\n'


def test_all_problems_are_reported_at_once(refuse):
    keys = 'kind = "articulate"\nsegment = 3\nlinks = true\nbaked = 1\ncoordinates = "polar"\n'
    keys += 'functions = ["crba", "energy", "energy"]\nreal = "half"\nemission = "loop"\n'
    keys += 'description = 3\nname = "Rat"\n'
    parameters = "tail_mas = 2\ntail_length = nan\ntorso_inertia = [1, 2, 4]\nlink_radius = -1\n"
    problems = refuse(f"{keys}[parameters]\n{parameters}")
    expected = "kind segment segments links baked coordinates real emission description name"
    expected += " functions[0] functions[2] parameters.tail_mas parameters.tail_length"
    expected += " parameters.torso_inertia parameters.link_radius"
    assert set(problems) == set(expected.split()) and problems["links"].value is True


def test_counts_are_whole_numbers_from_1(refuse):
    values = ["0", "-1", "true", '"3"', "3.0", "3.5", "nan", "[3]", "1979-05-27"]
    for key, other in (("segments", "links"), ("links", "segments")):
        for value in values:
            with row(key, value):
                field = "segments[0]" if (key, value) == ("segments", "[3]") else key
                assert set(refuse(f"{LINKS}{key} = {value}\n{other} = 1\n")) == {field}
    for key in ("kind", "segments", "links"):
        lines = [line for line in VALID.splitlines() if not line.startswith(key)]
        assert refuse("\n".join(lines))[key].value is None


def test_absurd_tails_are_refused_and_the_largest_taken(refuse, read):
    straight = '\nemission = "straight"'
    rows = [
        (f"{LINKS}segments = 1\nlinks = 10001", "segments * links", "10000 links"),
        (f"{LINKS}segments = 1\nlinks = 0x" + "f" * 5000, "segments * links", "10000 links"),
        (f"{LINKS}segments = 101\nlinks = 1", "segments", "100 segments"),
        (f"{LINKS}segments = 99999\nlinks = 1", "segments", "100 segments"),
        (f"{LINKS}segments = 21\nlinks = 1{straight}", "segments", '20 segments of emission "str'),
        (f"{LINKS}segments = 1\nlinks = 101{straight}", "segments * links", "100 links of em"),
        ('kind = "continuum"\nsegments = 2\nsamples = 5001', "segments * samples", "10000 samples"),
    ]
    for text, field, words in rows:
        with row(text[:60]):
            remedy = refuse(text)[field].remedy
            assert words in remedy and "fewer" in remedy
    assert scene_for("articulated", 100, 100).segments == 100
    assert scene_for("articulated", 20, 5, emission="straight").links == 5
    assert scene_for("continuum", 2, samples=5000).samples == 5000


def test_unknown_names_come_with_a_suggestion(refuse_rows):
    below, above = VALID + "[parameters]\n", "functions = "
    rows = [
        ("segmnts = 1\n" + VALID, "segmnts", "'segments'"),
        ("N = 1\n" + VALID, "N", "'links'"),
        ("zzz = 1\n" + VALID, "zzz", "name, description, kind, "),
        ("tail_mass = 1\n" + VALID, "tail_mass", "below the line [parameters]"),
        (below + "baked = true", "parameters.baked", "above the line [parameters]"),
        (below + "tail_mas = 1", "parameters.tail_mas", "'tail_mass'"),
        (above + '["mass_matrx"]\n' + VALID, "functions[0]", "'mass_matrix'"),
        (above + '["energy", "aba"]\n' + VALID, "functions[1]", "'forward_dynamics'"),
        (above + '["energy", "momentum", "energy"]\n' + VALID, "functions[2]", "before"),
        (above + '["energy", "+momentum"]\n' + VALID, "functions", "exactly these"),
        (above + '["+energi"]\n' + VALID, "functions[0]", "'energy'"),
        ('purpose = ["plann"]\n' + VALID, "purpose", "simulate, plan"),
    ]
    refuse_rows(rows)


def test_values_of_keys_are_refused_with_what_fits(refuse_rows):
    """All wrong types of one choice, and one or more wrong values of every key."""
    choices = [(key, "1") for key in ("coordinates", "emission", "profile", "friction", "base")]
    wrong = ('"Double"', '""', "true", "1", "[]", '["double"]', "{}")
    choices += [("real", value) for value in wrong]
    rows = [
        (f"{key} = {value}\n" + STANCE, key, f'"{getattr(Scene, key)}"') for key, value in choices
    ]
    rows += [
        (f"{key} = {value}\n" + VALID, key, "true or false")
        for key, value in (*(("baked", x) for x in ("1", "0", '"true"', "[]")), ("weightless", "1"))
    ]
    for value in ("[]", '"energy"', "true", "{}", "3"):
        rows += [(f"functions = {value}\n" + VALID, "functions", "mass_matrix")]
    for value in ("3", "true", "[]", '["energy"]', '""', "{}"):
        rows += [(f'functions = ["energy", {value}]\n' + VALID, "functions[1]", "mass_matrix")]
    for value in ("[]", '"c"', '["c", "c"]', '["rust"]', "[1]", "true"):
        rows += [(f"targets = {value}\n" + VALID, "targets", '"casadi"')]
    for value in ('["foot"]', '["feet", "feet"]', '"feet"', "true", "[3]", "[[]]"):
        rows += [(f"contacts = {value}\n" + VALID, "contacts", '"torso"')]
    for name in ("plan", "simulate", "identify", "sweep"):
        rows += [(f"{name} = 3\n" + VALID, name, f"[{name}]")]
    for value in ("3", "[3]", "{name = 1}"):
        rows += [(f"phase = {value}\n" + VALID, "phase", "[[phase]]")]
    rows += [('coordinates = "polar"\n' + VALID, "coordinates", "singular")]
    rows += [("samples = 3\n" + VALID, "samples", "remove")]
    refuse_rows(rows)


def test_keys_of_the_ground_and_of_a_base_that_do_not_fit(refuse_rows):
    tail, feet = VALID + 'contacts = ["tail"]\n', '"feet"'
    arc = 'kind = "continuum"\nsegments = 1\n'
    polar, fixed = arc + 'coordinates = "polar"\n', VALID + 'base = "fixed"\n'
    refuse_rows(
        [
            (VALID + 'friction = "smooth"\n', "friction", feet),
            (VALID + 'functions = ["contact_points"]\n', "functions", feet),
            (VALID + 'functions = ["leg_points"]\n', "functions", feet),
            (tail + 'functions = ["leg_points"]\n', "functions", "needs feet"),
            (VALID + "[parameters]\nmu = 0.5\n", "parameters.mu", feet),
            (tail + "[parameters]\nL_m2t = 0.5\n", "parameters.L_m2t", feet),
            (STANCE + 'friction = "coulomb"\n', "friction", '"paper"'),
            (polar + 'contacts = ["tail"]\n', "contacts", '"bend"'),
            (polar + 'functions = ["forward_dynamics_derivatives"]\n', "coordinates", "forward_"),
            (polar + 'functions = "all"\n', "coordinates", '"bend"'),
            (fixed + 'contacts = ["tail"]\nfunctions = ["energy"]\n', "contacts", '"free"'),
            (fixed + 'functions = ["energy", "inverse_dynamics_hessian"]\n', "functions", '"free"'),
            (fixed + "[parameters]\ntorso_mass = 1\n", "parameters.torso_mass", "fixed"),
            (VALID + "weightless = true\n[parameters]\ngravity = 1\n", "parameters.gravity", "wei"),
        ]
    )


def test_names_are_c_identifiers_that_hide_no_header_and_lead_nowhere(refuse_rows, tmp_path):
    one = {"kind": "articulated", "segments": 1, "links": 1}
    refuse_rows((one | {"name": name}, "name", "63") for name in NAMES)
    for name in GOOD_NAMES:
        assert scene_for("articulated", 1, 1, name=name).name == name
    path = tmp_path / "Kangaroo rat.toml"
    path.write_text(VALID)
    with pytest.raises(SceneError, match=r"^name: value 'Kangaroo rat': .* rename the file"):
        load_scene(path)


def test_each_problem_is_one_short_line_that_crosses_process_borders(refuse):
    line = str(refuse('real = "' + "long\\n" * 1000 + '"\n' + VALID)["real"])
    assert len(line) < 200
    assert "\n" not in str(Problem("a\nb" * 1000, "a\nb", "remedy"))
    assert str(Problem("a", None, "b")) == "a: no value: b"
    shown = [str(Problem("a" * n, 1, "")).split(":")[0] for n in (80, 81)]
    assert shown == ["a" * 80, "a" * 77 + "..."]
    with pytest.raises(SceneError) as caught:
        scene_for("articulated", 0, 0)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


# Broken files


def test_files_that_are_not_toml_are_refused_with_the_place(read):
    rows = [
        ("segments = \n", "line 1, column 12"),
        ("links = 1\nlinks = 2\n", "line 2"),
        (b"links = 1\nkind = '\xff'", "byte 18"),
    ]
    for text, words in rows:
        with row(text[:20]), pytest.raises(SceneError, match=words) as caught:
            read(text)
        assert "rat.toml" in caught.value.problems[0].value
    assert read(b"\xef\xbb\xbf" + VALID.replace("\n", "\r\n").encode()) == read(VALID)


def test_both_packages_refuse_what_is_no_scene_file_in_one_line(tmp_path):
    texts = {
        "empty name": b"kind = ",
        "latin": b"kind = '\xff'",
        "large": b"#" * 1_000_001,
        "deep key": b"a." * 3000 + b"a = 1",
        "deep number": b"1.1 . " * 3000 + b"1 = 1",
        "deep header": b"[" + b"a." * 100_000 + b"a]",
        "deep quoted key": b'"=".' * 10_000 + b"a = 1",
        "deep array": b"a = " + b"[" * 100_000,
        "digits": b"a = " + b"9" * 100_000,
        "nul": b"a = 1\0",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_bytes(text)
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "loop.toml").symlink_to(tmp_path / "loop.toml")
    names = (*texts, "pipe", "folder", "loop", "absent", "a\0", "a" * 5000)
    paths = {name: tmp_path / f"{name}.toml" for name in names}
    paths |= {"endless": Path("/dev/zero"), "null": Path("/dev/null")}
    for what, path in paths.items():
        with row(what):
            with pytest.raises(SceneError, match=r"^scene file: ") as by_generator:
                load_scene(path)
            if what == "null":  # a device that ends at once is none either
                assert "no regular file" in str(by_generator.value)
            with pytest.raises(ModelError, match="scene file") as by_runtime:
                read_scene(path, ModelError)
            for line in (str(by_generator.value), str(by_runtime.value)):
                assert "\n" not in line and len(line) < 500


def test_sizes_of_files_and_depths_of_keys_have_bounds(tmp_path):
    """A file of 1 MB and 100 dots in a line are taken; dots of numbers are none."""
    path = tmp_path / "t.toml"
    numbers = ", ".join(["0.1", "-2.5e-3", "1_0.0", "+3.25E8"] * 5000)
    text = f"{VALID}[plan]\nx = [{numbers}]\n{'a.' * 100}a = 1\n#"
    path.write_text(text + "-" * (1_000_000 - len(text)))
    assert load_scene(path).links == 3
    assert len(read_scene(path, ModelError)[0]["plan"]["x"]) == 20_000
    for wrong in (text + "-" * (1_000_001 - len(text)), f"{VALID}[plan]\n{'a.' * 101}a = 1\n"):
        path.write_text(wrong)
        with pytest.raises(SceneError, match="scene file"):
            load_scene(path)
