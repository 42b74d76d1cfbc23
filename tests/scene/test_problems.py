"""What is wrong in a scene file is told all at once, with a remedy for each."""

import pickle

import pytest

from serpentail_codegen.scene.parse import load_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import Problem, SceneError
from serpentail_codegen.scene.scene import Scene
from tests.support.scenes import VALID


def test_all_problems_are_reported_at_once(refuse):
    problems = refuse(
        'kind = "articulate"\nsegment = 3\nlinks = true\nfunctions = ["crba", "energy", "energy"]\n'
        'coordinates = "polar"\nbaked = 1\nreal = "half"\nemission = "loop"\ndescription = 3\nname '
        '= "Rat"\n'
        "[parameters]\ntail_mas = 2\ntail_length = nan\ntorso_inertia = [1, 2, 4]\nlink_radius = "
        "-1\n"
    )
    assert set(problems) == {
        *(
            "kind",
            "segment",
            "segments",
            "links",
            "baked",
            "functions[0]",
            "functions[2]",
            "coordinates",
        ),
        *("real", "emission", "description", "name"),
        *(
            f"parameters.{name}"
            for name in ("tail_mas", "tail_length", "torso_inertia", "link_radius")
        ),
    }
    assert problems["links"].value is True


@pytest.mark.parametrize("key", ["segments", "links"])
@pytest.mark.parametrize(
    "value", ["0", "-1", "true", '"3"', "3.0", "3.5", "nan", "[3]", "1979-05-27"]
)
def test_counts_are_whole_numbers_from_1(refuse, key, value):
    text = "".join(f"{k} = {value if k == key else 1}\n" for k in ("segments", "links"))
    field = "segments[0]" if (key, value) == ("segments", "[3]") else key
    assert set(refuse('kind = "articulated"\n' + text)) == {field}


@pytest.mark.parametrize("key", ["kind", "segments", "links"])
def test_required_keys(refuse, key):
    problem = refuse("\n".join(line for line in VALID.splitlines() if not line.startswith(key)))[
        key
    ]
    assert str(problem).startswith(f"{key}: no value: needs ")


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        ("segments = 1\nlinks = 10001", "segments * links", "more than 10000 links in all"),
        ("segments = 1\nlinks = 0x" + "f" * 5000, "segments * links", "more than 10000 links"),
        ("segments = 99999\nlinks = 1", "segments", "more than 100 segments would take hours"),
        (
            'segments = 21\nlinks = 1\nemission = "straight"',
            "segments",
            'more than 20 segments of emission "straight" would take hours',
        ),
        (
            'segments = 1\nlinks = 101\nemission = "straight"',
            "segments * links",
            'more than 100 links of emission "straight" in all',
        ),
    ],
)
def test_absurd_tails_are_refused(refuse, text, field, words):
    problems = refuse('kind = "articulated"\n' + text)
    assert words in problems[field].remedy and "fewer" in problems[field].remedy


def test_samples_of_a_continuum_are_bounded_too(refuse):
    problems = refuse('kind = "continuum"\nsegments = 2\nsamples = 5001')
    assert "more than 10000 samples in all" in problems["segments * samples"].remedy


def test_the_largest_tails_are_accepted():
    assert scene_for("articulated", 100, 100).segments == 100
    assert scene_for("articulated", 20, 5, emission="straight").links == 5


@pytest.mark.parametrize(
    ("text", "field", "remedy"),
    [
        ("segmnts = 1\n" + VALID, "segmnts", "did you mean 'segments'?"),
        ("N = 1\n" + VALID, "N", "did you mean 'links'?"),
        ("zzz = 1\n" + VALID, "zzz", "known: name, description, kind, "),
        ("tail_mass = 1\n" + VALID, "tail_mass", "belongs below the line [parameters]"),
        (
            VALID + "[parameters]\nbaked = true",
            "parameters.baked",
            "belongs above the line [parameters]",
        ),
        (VALID + "[parameters]\ntail_mas = 1", "parameters.tail_mas", "did you mean 'tail_mass'?"),
        (VALID + "[parameter]\n", "parameter", "did you mean 'parameters'?"),
        ('functions = ["mass_matrx"]\n' + VALID, "functions[0]", "did you mean 'mass_matrix'?"),
        (
            'functions = ["energy", "aba"]\n' + VALID,
            "functions[1]",
            "did you mean 'forward_dynamics'?",
        ),
        ('functions = ["qqq"]\n' + VALID, "functions[0]", "known: mass_matrix, bias_force, "),
    ],
)
def test_unknown_names_come_with_a_suggestion(refuse, text, field, remedy):
    problems = refuse(text)
    assert set(problems) == {field}
    assert remedy in problems[field].remedy


@pytest.mark.parametrize("value", ["[]", '"energy"', "true", "{}", "3"])
def test_functions_are_an_array_of_names(refuse, value):
    assert set(refuse(f"functions = {value}\n" + VALID)) == {"functions"}


@pytest.mark.parametrize("value", ["3", "true", "[]", '["energy"]', '""', "{}"])
def test_each_function_is_a_name(refuse, value):
    assert set(refuse(f'functions = ["energy", {value}]\n' + VALID)) == {"functions[1]"}


def test_duplicate_functions(refuse):
    problem = refuse('functions = ["energy", "momentum", "energy"]\n' + VALID)["functions[2]"]
    assert str(problem) == "functions[2]: value 'energy': listed before; remove one of the two"


@pytest.mark.parametrize("key", ["coordinates", "real", "emission", "profile"])
@pytest.mark.parametrize("value", ['"Joint"', '""', "true", "1", "[]", '["joint"]', "{}"])
def test_choices(refuse, key, value):
    assert f'"{getattr(Scene, key)}"' in refuse(f"{key} = {value}\n" + VALID)[key].remedy


def test_polar_coordinates_are_refused_with_the_reason(refuse):
    remedy = refuse('coordinates = "polar"\n' + VALID)["coordinates"].remedy
    assert remedy == 'needs "joint"; polar angles are singular at theta = 0, convert states'


@pytest.mark.parametrize("value", ["[]", '"c"', '["c", "c"]', '["rust"]', "[1]", "true"])
def test_targets_are_different_names(refuse, value):
    (problem,) = refuse(f"targets = {value}\n" + VALID).values()
    assert problem.remedy == (
        'needs an array of different names out of "c" and "casadi", at least one, such as ["c"]'
    )


def test_targets_have_an_order_and_are_all_by_default(read):
    assert read(VALID).targets == ("c", "casadi")
    scene = read('targets = ["casadi", "c"]\n' + VALID)
    assert scene.targets == ("c", "casadi") and scene_to_dict(scene)["targets"] == ["c", "casadi"]


@pytest.mark.parametrize("value", ["1", "0", '"true"', "[]"])
def test_baked_is_true_or_false(refuse, value):
    assert set(refuse(f"baked = {value}\n" + VALID)) == {"baked"}


@pytest.mark.parametrize(
    "value", ['"Rat"', '"1rat"', '"a-b"', '""', '"_a"', '"rät"', '"a\\n"', "3", "true"]
)
def test_names_are_c_identifiers(refuse, value):
    assert set(refuse(f"name = {value}\n" + VALID)) == {"name"}


def test_a_file_stem_that_is_no_identifier(tmp_path):
    path = tmp_path / "Kangaroo rat.toml"
    path.write_text(VALID)
    with pytest.raises(SceneError, match=r"^name: value 'Kangaroo rat': needs .* rename the file"):
        load_scene(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("segments = \n", "at line 1, column 12"),
        ("links = 1\nlinks = 2\n", "at line 2"),
        (b"links = 1\nkind = '\xff'", "not UTF-8 from byte 18 on"),
        ("links = " + "[" * 10_000, "cannot be read as TOML"),
        ("links = " + "9" * 5_000, "cannot be read as TOML"),
        ("links = 1\0", "cannot be read as TOML"),
    ],
)
def test_files_that_are_not_toml(read, text, message):
    with pytest.raises(SceneError) as caught:
        read(text)
    assert message in str(caught.value)
    assert "rat.toml" in caught.value.problems[0].value


def test_a_byte_order_mark_and_carriage_returns_do_no_harm(read):
    assert read(b"\xef\xbb\xbf" + VALID.replace("\n", "\r\n").encode()) == read(VALID)


@pytest.mark.parametrize("name", ["absent.toml", ".", "nul\0.toml"])
def test_files_that_cannot_be_read(tmp_path, name):
    with pytest.raises(SceneError) as caught:
        load_scene(tmp_path / name)
    assert [problem.field for problem in caught.value.problems] == ["scene file"]


def test_each_problem_stays_on_one_short_line(refuse):
    line = str(refuse('real = "' + "long\\n" * 1000 + '"\n' + VALID)["real"])
    assert len(line) < 200
    assert "\n" not in str(Problem("a\nb" * 1000, "a\nb", "remedy"))


def test_scene_errors_cross_process_borders():
    with pytest.raises(SceneError) as caught:
        scene_for("articulated", 0, 0)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


@pytest.mark.parametrize("name", ["math", "stdio", "features"])
def test_a_model_hides_no_c_header(name):
    with pytest.raises(SceneError, match="names no C header"):
        scene_for("articulated", 1, 1, name=name)
