"""Options of the command line are part of a model's name: none overwrites another's folder."""

import pytest

from serpentail_codegen.__main__ import main, parser, scene_of
from tests.support.scenes import VALID

SIZE = ["--tail", "articulated", "--segments", "1", "--links", "3"]


def named(*arguments):
    return scene_of(parser().parse_args(arguments)).name


@pytest.mark.parametrize(
    ("options", "suffix"),
    [
        ([], ""),
        (["--real", "double", "--emission", "auto", "--profile", "fast"], ""),
        (["--real", "float"], "_float"),
        (["--baked", "--emission", "loops", "--real", "float"], "_float_loops_baked"),
        (["--profile", "reproducible"], "_reproducible"),
        (["--functions", "all"], "_all"),
        (["--functions", "mass_matrix"], "_fc4a05d"),
        (["--real", "float", "--functions", "mass_matrix"], "_float_fc4a05d"),
    ],
)
def test_what_an_option_changes_is_part_of_the_name(options, suffix):
    assert named(*SIZE, *options) == f"articulated_m1_n3{suffix}"


def test_the_order_of_functions_means_nothing():
    names = {
        named(*SIZE, "--functions", chosen) for chosen in ("energy,momentum", "momentum,energy")
    }
    assert len(names) == 1 and names != {named(*SIZE, "--functions", "energy")}


def test_a_scenes_own_choice_is_no_part_of_its_name(tmp_path):
    path = tmp_path / "rat.toml"
    path.write_text(VALID + 'real = "float"\nbaked = true\nfunctions = ["energy"]\n')
    own = ["--real", "float", "--baked", "--functions", "energy"]
    assert named(str(path), *own) == named(str(path)) == "rat"
    assert named(str(path), "--real", "double") == "rat_double"


def test_a_name_that_is_given_stays_and_is_checked(capsys):
    assert named(*SIZE, "--real", "float", "--name", "own") == "own"
    assert main([*SIZE, "--name", "../own"]) == 2
    assert capsys.readouterr().err.startswith("name: value '../own': needs a text of up to 63")


def test_a_name_that_options_make_too_long_is_refused(tmp_path, capsys):
    path = tmp_path / ("a" * 60 + ".toml")
    path.write_text(VALID)
    assert main([str(path), "--real", "float"]) == 2
    assert f"name: value '{'a' * 60}_float': needs a text of up to 63" in capsys.readouterr().err
