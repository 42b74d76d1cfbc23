"""Scene files: what is accepted, what it becomes, and that all else is refused with all of its
problems.
"""

import json
import math
import pickle
import random
import subprocess
import sys
from pathlib import Path

import pytest

from serpentail_codegen.scene.parameters import PARAMETERS
from serpentail_codegen.scene.parse import load_scene, parse_scene, scene_for, scene_to_dict
from serpentail_codegen.scene.problems import Problem, SceneError
from serpentail_codegen.scene.resolve import resolve_parameters
from serpentail_codegen.scene.scene import FUNCTIONS, GROUPS, KEYS, ONLY, TOUCHING, Scene

SCENES = Path(__file__).parents[2] / "scenes"
VALID = 'kind = "articulated"\nsegments = 2\nlinks = 3\n'


@pytest.fixture
def read(tmp_path):
    """Return a function from the text (or bytes) of a scene file to its Scene."""

    def read_text(text: str | bytes) -> Scene:
        path = tmp_path / "rat.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_scene(path)

    return read_text


@pytest.fixture
def refuse(read):
    """Return a function from the text of a wrong scene file to its problems, by field."""

    def problems(text: str) -> dict[str, Problem]:
        with pytest.raises(SceneError) as caught:
            read(text)
        lines = str(caught.value).splitlines()
        assert [line.split(": ")[0] for line in lines] == [
            problem.field for problem in caught.value.problems
        ]
        return {problem.field: problem for problem in caught.value.problems}

    return problems


def test_defaults_are_table_1_in_si_units(read):
    assert dict(read(VALID).parameters) == {
        "gravity": 9.8,
        "torso_mass": pytest.approx(105.72e-3, rel=1e-15),
        "torso_inertia": pytest.approx((672.2e-7, 363.9e-7, 727.9e-7), rel=1e-15),
        "tail_mount": pytest.approx((0.0, -40.5e-3, 4.5e-3), rel=1e-15),
        "tail_mass": pytest.approx(3.51e-3, rel=1e-15),
        "tail_length": pytest.approx(194.66e-3, rel=1e-15),
        "link_radius": pytest.approx(2.9e-3, rel=1e-15),
        "link_inertia": pytest.approx((3.17716e-08, 1.96794e-09, 3.17716e-08), rel=1e-5),
    }


def test_defaults_of_the_other_keys(read):
    scene = read(VALID)
    assert scene == Scene("rat", "articulated", 2, 3, FUNCTIONS, resolve_parameters({}, 6))
    assert (scene.coordinates, scene.baked, scene.real, scene.emission) == (
        "joint",
        False,
        "double",
        "auto",
    )
    assert scene.profile == "fast"


def test_the_parameter_table_keeps_its_own_rules():
    given = {p.name: p.default for p in PARAMETERS if p.default is not None}
    assert resolve_parameters(given, 6, contacts=GROUPS) == resolve_parameters(
        {}, 6, contacts=GROUPS
    )
    assert all(p.unit and p.meaning and p.size in (1, 3) for p in PARAMETERS)


def test_link_inertia_is_that_of_a_uniform_ellipsoid():
    """Moments of mass by midpoint quadrature over the ellipsoid's discs along y."""
    given = {"tail_mass": 0.03, "tail_length": 0.5, "link_radius": 0.02}
    m, half, r, discs = 0.03 / 5, 0.5 / 5 / 2, 0.02, 2000
    y = [half * (2 * (k + 0.5) / discs - 1) for k in range(discs)]
    weight = [1 - (s / half) ** 2 for s in y]
    along = sum(w * r**2 * w / 2 for w in weight) * m / sum(weight)
    across = (
        sum(w * (r**2 * w / 4 + s**2) for w, s in zip(weight, y, strict=True)) * m / sum(weight)
    )
    expected = pytest.approx((across, along, across), rel=1e-6)
    assert resolve_parameters(given, 5)["link_inertia"] == expected


def test_given_link_inertia_replaces_the_radius(read):
    parameters = read(VALID + "[parameters]\nlink_inertia = [1e-8, 0, 1e-8]\n").parameters
    assert parameters["link_inertia"] == (1e-8, 0.0, 1e-8)
    assert "link_radius" not in parameters
    assert set(parameters) == {p.name for p in PARAMETERS if not p.needs} - {"link_radius"}


def test_zeros_are_allowed_and_lose_their_sign(read):
    parameters = read(
        VALID + "[parameters]\nlink_radius = 0\ngravity = -0.0\ntail_mount = [0, -0.0, 0]"
    ).parameters
    assert parameters["link_inertia"][1] == 0
    assert [math.copysign(1, x) for x in (parameters["gravity"], *parameters["tail_mount"])] == [
        1
    ] * 4


@pytest.mark.parametrize(
    "moments", [[1, 1, 1], [1, 2, 3], [1e-5, 2e-5, 3e-5], [0.2, 0.7, 0.9], [3e-9, 1e-9, 2e-9]]
)
def test_torso_inertia_may_be_that_of_a_flat_body(moments):
    assert resolve_parameters({"torso_inertia": moments}, 1)["torso_inertia"] == tuple(moments)


def test_numbers_become_floats(read):
    parameters = read(VALID + "[parameters]\ngravity = 10\ntail_mount = [0, -1, 0]\n").parameters
    assert [type(x) for x in (parameters["gravity"], *parameters["tail_mount"])] == [float] * 4


def test_functions_come_in_canonical_order(read):
    assert read('functions = ["energy", "mass_matrix"]\n' + VALID).functions == (
        "mass_matrix",
        "energy",
    )


def test_name_is_the_file_stem_or_the_name_given(read):
    assert read(VALID).name == "rat"
    assert read('name = "kick_2"\n' + VALID).name == "kick_2"


def test_scene_for_make_model():
    scene = scene_for(
        "articulated", 3, 4, baked=True, functions=["energy"], parameters={"gravity": 0}
    )
    assert (scene.name, scene.segments, scene.links) == ("articulated_m3_n4", 3, 4)
    assert (scene.baked, scene.functions, scene.parameters["gravity"]) == (True, ("energy",), 0.0)
    with pytest.raises(
        SceneError, match=r"^kind: value 'Elastic-2': needs \"articulated\" or \"continuum\"$"
    ):
        scene_for("Elastic-2", 3, 4)


def test_scenes_are_frozen_and_hashable():
    scene, same = scene_for("articulated", 3, 4), scene_for("articulated", 3, 4)
    assert len({scene, same, scene_for("articulated", 4, 3)}) == 2
    with pytest.raises(AttributeError):
        scene.links = 5
    with pytest.raises(TypeError):
        scene.parameters["gravity"] = 0


@pytest.mark.parametrize(
    "parameters", [{"tail_mass": 0.1 + 0.2}, {"link_inertia": [1e-8 / 3, 2e-10, 1]}, {}]
)
def test_round_trip_is_exact(parameters):
    scene = scene_for("articulated", 2, 7, real="float", emission="loops", parameters=parameters)
    table = json.loads(json.dumps(scene_to_dict(scene), allow_nan=False))
    assert parse_scene(table, "another") == scene
    assert scene_to_dict(parse_scene(table, "another")) == table
    assert pickle.loads(pickle.dumps(scene)) == scene


@pytest.mark.parametrize(("segments", "links"), [(1, 3), (3, 4)])
def test_the_paper_rats(segments, links):
    scene = load_scene(SCENES / f"kangaroo_rat_m{segments}_n{links}.toml")
    assert (scene.segments, scene.links) == (segments, links)
    assert scene.name == f"kangaroo_rat_m{segments}_n{links}"
    assert scene.functions == FUNCTIONS
    assert scene.parameters == resolve_parameters({}, scene.segments * scene.links)


def test_the_full_scene_file_shows_every_key():
    text = "".join(
        (SCENES / f"{name}_m1_n3.toml").read_text() for name in ("kangaroo_rat", "contact")
    )
    words = [
        *(set(KEYS) - {"name", "parameters", "plan", "simulate", *ONLY["continuum"].keys}),
        *(p.name for p in PARAMETERS),
    ]
    assert [word for word in words if f"{word} =" not in text] == []


@pytest.mark.parametrize("name", ["plan", "simulate"])
def test_tables_of_motions_are_left_to_the_runtime(refuse, name):
    alone = {"kind": "articulated", "segments": 1, "links": 3}
    assert parse_scene(alone | {name: {"anything": 1}}, "rat") == parse_scene(alone, "rat")
    wrong = refuse(f'kind = "articulated"\nsegments = 1\nlinks = 1\n{name} = 3\n')
    assert f"under a line [{name}]" in str(wrong[name])
    assert (SCENES / "righting_m1_n3.toml").is_file() and load_scene(
        SCENES / "righting_m1_n3.toml"
    ).links == 3


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
    assert set(refuse('kind = "articulated"\n' + text)) == {key}


@pytest.mark.parametrize("key", ["kind", "segments", "links"])
def test_required_keys(refuse, key):
    problem = refuse("\n".join(line for line in VALID.splitlines() if not line.startswith(key)))[
        key
    ]
    assert str(problem).startswith(f"{key}: no value: needs ")


@pytest.mark.parametrize("size", ["100001", "0x" + "f" * 5000])
def test_absurd_tails_are_refused(refuse, size):
    problem = refuse(f'kind = "articulated"\nsegments = 1\nlinks = {size}')["segments * links"]
    assert "fewer" in problem.remedy


def test_the_largest_tail_is_accepted():
    assert scene_for("articulated", 1000, 100).segments == 1000


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
@pytest.mark.parametrize(
    "bad", ["true", '"3"', "nan", "inf", "-inf", "{}", "[]", "12:30:00", "9" * 400]
)
def test_parameters_are_finite_numbers(refuse, parameter, bad):
    value = bad if parameter.size == 1 else f"[1.0, {bad}, 1.0]"
    problems = refuse(VALID + f"[parameters]\n{parameter.name} = {value}")
    assert set(problems) == {f"parameters.{parameter.name}"}
    assert parameter.unit in problems[f"parameters.{parameter.name}"].remedy


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.name)
def test_parameters_have_their_size(refuse, parameter):
    right, field = ("1", "[1, 1, 1]")[parameter.size > 1], f"parameters.{parameter.name}"
    for value in {"1", "[]", "[1]", "[1, 1]", "[1, 1, 1]", "[1, 1, 1, 1]", "[[1, 1, 1]]"} - {right}:
        assert set(refuse(VALID + f"[parameters]\n{parameter.name} = {value}")) == {field}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(
            (name, value)
            for name in ("torso_mass", "tail_mass", "tail_length")
            for value in ("0", "-1e-3")
        ),
        *((name, "-1e-3") for name in ("gravity", "link_radius")),
        *(
            ("torso_inertia", value)
            for value in ("[1, 1, 2.01]", "[3, 1, 1]", "[0, 1, 1]", "[1, -1, 1]")
        ),
        ("link_inertia", "[1, -1e-30, 1]"),
    ],
)
def test_parameters_are_physical(refuse, name, value):
    assert set(refuse(VALID + f"[parameters]\n{name} = {value}")) == {f"parameters.{name}"}


def test_link_inertia_and_link_radius_exclude_each_other(refuse):
    problems = refuse(VALID + "[parameters]\nlink_inertia = [1, 1, 1]\nlink_radius = 0.003")
    assert "remove one" in problems["parameters.link_inertia"].remedy


def test_a_computed_inertia_has_to_be_finite(refuse):
    assert set(refuse(VALID + "[parameters]\ntail_length = 1e200")) == {"parameters.link_inertia"}


@pytest.mark.parametrize("value", ["3", "[]", '"gravity"', "[{}]"])
def test_parameters_are_a_table(refuse, value):
    assert set(refuse(f"parameters = {value}\n" + VALID)) == {"parameters"}


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


# fmt: off
VALUES = [
    "true", "false", "nan", "-inf", "0", "-1", "1", "3.5", "1e308", "9" * 400, "0x" + "f" * 4000, "12:30:00",
    '""', '"3"', '"polar"', '"float"', "[]", "{}", "[1, 1, 1]", ("[1, 2, " "3.1]"), '["energy"]', "[[[]]]", "[{}]",
]
PIECES = [
    "[[", "]", "=", "#", ".", "\n", "'''", "\\", "\0", "\udcff", "é", "functions", "link_inertia", "name",
    "[parameters]", "[[parameters]]", "[parameters.x]", '"\\u0000" = 1\n', *VALUES,
]
# fmt: on


def _mutate(text: str, dice: random.Random) -> str:
    """Replace, insert or swap a few pieces of the text."""
    for _ in range(dice.randint(1, 2)):
        start = dice.randrange(len(text) + 1)
        stop = min(len(text), start + dice.choice([0, 1, 3, 12]))
        piece = dice.choice([dice.choice(PIECES), text[dice.randrange(len(text) + 1) :][:20]])
        text = text[:start] + piece + text[stop:]
    return text


def _change_values(text: str, dice: random.Random) -> str:
    """Give one or two of the lines `key = value` another value, so that the text stays TOML."""
    lines = text.splitlines()
    for i in dice.sample([i for i, line in enumerate(lines) if " = " in line], dice.randint(1, 2)):
        lines[i] = f"{lines[i].partition(' = ')[0]} = {dice.choice(VALUES)}"
    return "\n".join(lines)


def _as_toml(scene: Scene) -> str:
    """Write a scene as a file, one line for each key."""
    table = {"description": "", **scene_to_dict(scene)}
    parameters = table.pop("parameters")
    top, below = (
        "".join(f"{key} = {json.dumps(value)}\n" for key, value in part.items())
        for part in (table, parameters)
    )
    return f"{top}[parameters]\n{below}"


@pytest.mark.parametrize("mutate", [_mutate, _change_values])
def test_damaged_files_never_raise_anything_but_scene_errors(read, mutate):
    scene, dice, survivors, errors = scene_for("articulated", 3, 4), random.Random(2023), [], []
    text = _as_toml(scene)
    assert read(text) == scene
    for _ in range(2000):
        try:
            survivors.append(read(mutate(text, dice).encode(errors="surrogateescape")))
        except SceneError as error:
            errors.append(error)
    assert any(error.problems[0].field != "scene file" for error in errors)
    assert all(len(str(error).split("\n")) == len(error.problems) > 0 for error in errors)
    assert all(
        parse_scene(scene_to_dict(survivor), "another") == survivor for survivor in survivors
    )
    assert survivors


def test_importing_the_loader_does_not_import_sympy():
    code = "import sys; import serpentail_codegen.scene.parse; print('sympy' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


CONTINUUM = 'kind = "continuum"\nsegments = 3\n'


def test_a_continuum_has_no_links(refuse):
    problems = refuse(CONTINUUM + "links = 4\n[parameters]\nlink_radius = 0.003\n")
    assert set(problems) == {"links", "parameters.link_radius"}
    assert all("remove it" in problem.remedy for problem in problems.values())


@pytest.mark.parametrize("value", ["0", "-1.0", "nan", "inf", "101", "true", '"2"'])
def test_bend_range_is_an_angle(refuse, value):
    assert set(refuse(CONTINUUM + f"bend_range = {value}\n")) == {"bend_range"}


def test_a_continuum_scene(tmp_path):
    scene = scene_for("continuum", 3, samples=7)
    assert (scene.name, scene.segments, scene.samples, scene.coordinates) == (
        "continuum_m3",
        3,
        7,
        "bend",
    )
    assert "link_inertia" not in scene.parameters
    assert parse_scene(scene_to_dict(scene), "other") == scene


def test_bend_range_and_samples_are_a_continuums_alone(refuse):
    assert set(refuse(VALID + "samples = 3\n")) == {"samples"}


@pytest.mark.parametrize("name", ["math", "stdio", "features"])
def test_a_model_hides_no_c_header(name):
    with pytest.raises(SceneError, match="names no C header"):
        scene_for("articulated", 1, 1, name=name)


@pytest.mark.parametrize("mass", [1e-50, 1e300])
def test_single_precision_holds_its_parameters(mass):
    with pytest.raises(SceneError, match="beyond single precision"):
        scene_for("articulated", 1, 1, real="float", parameters={"torso_mass": mass})


STANCE = VALID + 'contacts = ["torso", "feet"]\n'


def test_contacts_bring_their_parameters_and_functions(read):
    scene = read(STANCE)
    assert scene.contacts == ("feet", "torso") and scene.friction == "cone"
    assert scene.functions == (*FUNCTIONS, "pfl", "implicit", *TOUCHING)
    assert dict(scene.parameters).keys() - dict(read(VALID).parameters) == {
        p.name for p in PARAMETERS if p.needs
    }
    assert scene.parameters["L_a2m"] == 0.035 and scene.parameters["delta_m"] == pytest.approx(
        math.radians(30)
    )
    assert parse_scene(scene_to_dict(scene), "other") == scene
    tail = read(VALID + 'contacts = ["tail"]\nfriction = "box"\n')
    assert "mu" in tail.parameters and "hip" not in tail.parameters and tail.friction == "box"


def test_a_flight_says_nothing_of_contacts(read):
    scene = read(VALID)
    assert scene.contacts == () and not {"contacts", "friction"} & set(scene_to_dict(scene))
    assert not set(TOUCHING) & set(read(VALID + 'functions = "all"\n').functions)


@pytest.mark.parametrize("value", ['["foot"]', '["feet", "feet"]', '"feet"', "true", "[3]", "[[]]"])
def test_contacts_are_different_groups(refuse, value):
    assert refuse(VALID + f"contacts = {value}\n")["contacts"].remedy.startswith(
        "needs an array of different names"
    )


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        (VALID + 'friction = "box"\n', "friction", 'add contacts = ["feet"]'),
        (VALID + 'functions = ["contact_points"]\n', "functions", 'add contacts = ["feet"]'),
        (VALID + "[parameters]\nmu = 0.5\n", "parameters.mu", 'add "feet" to `contacts`'),
        (
            VALID + 'contacts = ["tail"]\n[parameters]\nL_m2t = 0.5\n',
            "parameters.L_m2t",
            'add "feet" to `contacts`',
        ),
        (
            STANCE + 'friction = "coulomb"\n',
            "friction",
            'needs "cone" or "box" or "smooth" or "paper"',
        ),
        (
            STANCE + "[parameters]\nmu = -0.1\n",
            "parameters.mu",
            "a finite number, 0 or above, in 1 (default: 1.0)",
        ),
        (STANCE + "[parameters]\nK_n = 0\n", "parameters.K_n", "above 0, in N/m^1.5"),
        (STANCE + "[parameters]\nD_f = 0.0\n", "parameters.D_f", "above 0, in s"),
        (STANCE + "[parameters]\nhip = [0, 1]\n", "parameters.hip", "an array of 3 finite numbers"),
        (CONTINUUM + 'coordinates = "polar"\ncontacts = ["tail"]\n', "contacts", 'use "bend"'),
    ],
)
def test_contact_keys_that_do_not_fit(refuse, text, field, words):
    problems = refuse(text)
    assert set(problems) == {field} and words in problems[field].remedy
