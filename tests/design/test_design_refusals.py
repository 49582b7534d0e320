"""Bad studies end in one line that says where and what would be right."""

import contextlib
import functools
import re
import tomllib
from importlib import resources

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from study_files import PLAIN, SMALL, changed, write_study

from fitting.cli import main
from fitting.design import read_study, run_study
from fitting.design.bodies import Plan
from fitting.design.log import Log
from fitting.design.posterior_file import posterior_draws
from pneusma_jax.errors import InputError

WALL = 'wall_thickness = {made = "continuous", from = 0.7, to = 1.6, unit = "mm"}'
COILS = 'active_coils = {made = "integer", from = 40, to = 70}'
BEND = 'quantity = "curvature"\ngoal = "maximise"\nstate = "hot"'
POSE = (
    'quantity = "tip_miss"\n'
    "poses = [{state = 'hot', target = {value = [0, 9, 60], unit = 'mm'}, direction = [0, 1, 1]}]"
)
FUNCTION = 'quantity = "function"\ngoal = "maximise"\nfile = "mine.py"\nfunction = "f"'
UNCERTAIN = SMALL + "\n[uncertainty]\n"

BAD = {
    "crossed bounds": (WALL, WALL.replace("0.7", "2.7"), "bounds are crossed"),
    "equal bounds": (WALL, WALL.replace("1.6", "0.7"), "[free] wall_thickness: bounds are equal, so nothing is free: 0.7 mm"),
    "equal whole bounds": (COILS, COILS.replace("70", "40"), "bounds are equal, so nothing is free: 40"),
    "negative target of springs": (BEND, 'quantity = "spring_force"\ngoal = "target"\ntarget = {value = -5, unit = "mN"}\nstate = "hot"', "target must not be negative: of spring_force the largest size of all springs counts"),
    "nothing free": (WALL + "\n" + COILS, "", "nothing is free"),
    "unknown parameter": ("wall_thickness", "wall_thicknes", "did you mean 'wall_thickness'"),
    "unit missing": (WALL, WALL.replace(', unit = "mm"', ""), "unit is missing; a length needs one"),
    "wrong unit": (WALL, WALL.replace('"mm"', '"kPa"'), "unit 'kPa' is not of the right kind"),
    "negative": (WALL, WALL.replace("0.7", "-0.7"), "must be positive"),
    "way of making": ('"continuous"', '"printed"', "made is 'printed'"),
    "step missing": ('made = "integer"', 'made = "steps"', "'step' is missing"),
    "long step": ('made = "integer"', 'made = "steps", step = 100', "longer than the range"),
    "broken integer": ("from = 40, to = 70", "from = 40.5, to = 70", "whole bounds"),
    "short catalogue": (COILS, 'active_coils = {made = "catalogue", values = [50]}', "at least two numbers"),
    "circle": (
        WALL + "\n",
        'wall_thickness = {from = 0.5, to = {parameter = "outer_diameter", times = 0.4}, unit = "mm"}\n'
        'outer_diameter = {from = 5, to = {parameter = "wall_thickness", times = 9}, unit = "mm"}\n',
        "in a circle",
    ),
    "bound of something fixed": (
        "to = 1.6", 'to = {parameter = "outer_diameter", times = 0.4}', "'outer_diameter' is not free",
    ),
    "choice among the free": (COILS, 'alloy = {made = "choice"}', "a choice stands above"),
    "unknown design": ('"pneusma2"', '"pneusma3"', "study.toml: design: no table of constants is called 'pneusma3', did you mean 'pneusma2'?"),
    "unknown alloy": ('starts = 3', 'alloy = ["krl35", "krl99"]', "study.toml: alloy: no table of constants is called 'krl99', did you mean 'krl45'? Known of kind alloy: krl35, krl45,"),
    "unknown silicone": ('starts = 3', 'material = "dragon_skin"', "study.toml: material: no table of constants is called 'dragon_skin'"),
    "no objective": ("[objective.bend]\n" + BEND, "", "there is no objective"),
    "unknown objective": ('"curvature"', '"curvatur"', "did you mean 'curvature'"),
    "unknown goal": ('"maximise"', '"more"', "goal is 'more'"),
    "unknown state": ('state = "hot"', 'state = "cold"', "there is no [state.cold]"),
    "target without unit": ('goal = "maximise"', 'goal = "target"\ntarget = {value = 40}', "unit is missing"),
    "pressure without unit": ('{value = 30, unit = "kPa"}', "30", "must be {value = .., unit"),
    "impossible pressure": ("value = 30", "value = 30000", "between -100 and 1000 kPa"),
    "impossible fraction": ("xi0_2 = 0.3", "xi0_2 = 1.3", "from 0 (hot) to 1 (cold)"),
    "no such spring": ("xi0_2 = 0.3", "xi0_3 = 0.3", "no design has a spring 3"),
    "limit missing": ('at_most = "tested"', "", "a limit is missing"),
    "nothing tested": ('at_most = {value = 58.3, unit = "mm"}', 'at_most = "tested"', "no range that was tested"),
    "unknown key": ("starts = 3", "startz = 3", "did you mean 'starts'"),
    "no starts": ("starts = 3", "starts = 0", "from 1 to 256"),
    "optimiser": ("starts = 3", 'optimiser = "newton"', "optimiser is 'newton'"),
    "schema": ("pneusma-study/1", "pneusma-study/9", "schema is"),
    "misspelt schema": ("schema =", "shcema =", "unknown key 'shcema', did you mean 'schema'? a study has schema"),
    "misspelt unit": ('{value = 30, unit = "kPa"}', '{value = 30, unit = "kpa"}', "unknown unit 'kpa', did you mean 'kPa'?"),
    "function's file": (BEND, 'quantity = "function"\ngoal = "maximise"\nfile = "none.py"', "there is no such file"),
    "workspace without springs": (
        'design = "pneusma2"', 'design = "pneuflex_s"', "no design has a spring 2",
    ),
    "segment of the whole": (BEND, BEND.replace("curvature", "tip_x") + "\nsegment = 1", "'segment' has no meaning"),
    "states of what is the same in all": (
        'quantity = "length"\nat_most = {value = 58.3, unit = "mm"}',
        'quantity = "wire_mass"\nat_most = {value = 1, unit = "g"}\nstates = ["hot"]', "the same in every state",
    ),
    "state of a stiffness range": (
        BEND, 'quantity = "stiffness_range"\ngoal = "maximise"\nstate = "hot"', "needs two 'states'",
    ),
    "state and states": (BEND, BEND + '\nstates = ["hot"]', "both given"),
    "direction of no tip": (BEND, BEND + "\ndirection = [0, 0, 1]", "unknown key 'direction'"),
    "pose without place": (BEND, POSE.replace("target = {value = [0, 9, 60], unit = 'mm'}, ", ""), "pose 1: target"),
    "pose without state": (BEND, POSE.replace("state = 'hot', ", ""), "pose 1: 'state' is missing"),
    "pose of an unknown state": (BEND, POSE.replace("'hot'", "'cold'"), "pose 1: there is no [state.cold]"),
    "direction without length": (BEND, POSE.replace("[0, 1, 1]", "[0, 0, 0]"), "direction has no length"),
    "direction of two numbers": (BEND, POSE.replace("[0, 1, 1]", "[0, 1]"), "direction must be three numbers"),
    "a state with two poses": (BEND, POSE.replace("poses = [", "poses = [{state = 'hot', target = {value = [0, 0, 9], unit = 'mm'}}, "), "poses name state 'hot' twice"),
    "a wall that leaves no bore": (WALL, WALL.replace("1.6", "40"), "[free] wall_thickness: nothing can be made at the upper end of its range: `wall_thickness` must be positive and leave a bore, but it is 40 mm in a tube of 10 mm"),
    "more coils than there is room": (COILS, COILS.replace("70", "500"), "active_coils: nothing can be made at the upper end of its range: `attached_length` must be at least the free length"),
    "a function that is no name": (BEND, FUNCTION.replace('"f"', "3"), "function must be the name of a function, but it is 3"),
    "a function without name": (BEND, FUNCTION.replace('"f"', '""'), "function must be the name of a function, but it is ''"),
}  # fmt: skip


@pytest.mark.parametrize("name", list(BAD))
def test_a_bad_study_is_refused_in_one_line(name, tmp_path):
    old, new, words = BAD[name]
    path = write_study(tmp_path, changed(old, new))
    (tmp_path / "mine.py").write_text("def f(s, p):\n    return s['hot'].only.curvature\n")
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        read_study(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("entry", ['"bending_stiffness"\nstate = "hot"', '"stiffness_range"\nstates = ["hot", "cold"]'])
def test_a_stiffness_of_free_bending_is_refused(entry, tmp_path):
    wanted = f'quantity = {entry}\ngoal = "maximise"\n[state.cold]\npressure = {{value = 30, unit = "kPa"}}\n'
    plane = changed(BEND, wanted)
    assert read_study(write_study(tmp_path, plane)).objectives[0].goal == "maximise"
    free = changed('"pneusma2"', '"triad"', plane)
    with pytest.raises(InputError, match="needs bending in a plane, but 'triad' bends freely"):
        read_study(write_study(tmp_path, free))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('objective = "median"\npriors = "alloy"', "objective is 'median'"),
        ('level = 1.5\npriors = "alloy"', "level must lie between 0 and 1"),
        ('posterior = "nowhere.nc"', "there is no such file"),
        ('priors = "steel"', "priors has 'steel'"),
        ("draws = 8", "names nothing that is uncertain"),
        ('posterior_specimen = 1\npriors = "alloy"', "posterior_specimen needs a posterior"),
        ('fresh_posterior = "p.nc"\npriors = "alloy"', "fresh_posterior needs a posterior"),
        ('k = 2\npriors = "alloy"', "'k' has no meaning"),
        ('level = 0.9\nconstraints = "mean"\npriors = "alloy"', "'level' has no meaning"),
        ("[uncertainty.tolerance]\nwall_thickness = {sd = 0.1}", "unit is missing"),
        ('[uncertainty.tolerance]\nwall = {sd = 0.1, unit = "mm"}', "no such dimension"),
    ],
)
def test_a_bad_uncertainty_is_refused_in_one_line(lines, words, tmp_path):
    with pytest.raises(InputError, match=re.escape(words)):
        read_study(write_study(tmp_path, UNCERTAIN + lines))


ODD = ([], ["mm"], {}, {"value": [1]}, "", "x", True, -1, 0, 1e308, float("nan"), 10**30)
"""Values that may stand where another kind is meant."""


def _leaves(table, where=()):
    for key, value in table.items():
        yield (*where, key)
        if isinstance(value, dict):
            yield from _leaves(value, (*where, key))


def _toml(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{k}" = {_toml(v)}' for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else str(value)


LEAVES = list(
    _leaves(
        tomllib.loads(UNCERTAIN + 'priors = ["alloy"]\ntolerance.wall_thickness = {sd = 0.1, unit = "mm"}')
    )
)


KNOWN = {}
"""Alloy and silicone by the names of their tables, read once: they are no part of the studies spoilt here."""


@pytest.mark.parametrize("leaf", LEAVES, ids=".".join)
def test_any_value_in_any_place_is_read_or_refused_in_one_line(leaf, tmp_path, monkeypatch):
    read = Plan.materials

    def materials(plan):
        key = plan.alloy, plan.silicone, tuple(table.name for table in plan.tables)
        if key not in KNOWN:
            KNOWN[key] = read(plan)
        return KNOWN[key]

    monkeypatch.setattr(Plan, "materials", materials)
    lines = 'priors = ["alloy"]\ntolerance.wall_thickness = {sd = 0.1, unit = "mm"}'
    for odd in ODD:
        document = tomllib.loads(UNCERTAIN + lines)
        table = functools.reduce(lambda inner, key: inner[key], leaf[:-1], document)
        table[leaf[-1]] = odd
        text = "\n".join(f"{key} = {_toml(value)}" for key, value in document.items())
        with contextlib.suppress(InputError):
            read_study(write_study(tmp_path, text))


def test_a_number_that_is_no_digit_is_no_segment(tmp_path):
    with pytest.raises(InputError, match="no such dimension of all designs"):
        read_study(write_study(tmp_path, changed("wall_thickness =", '"\u00b2.wall_thickness" =')))


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("def f(s, p):\n    raise RuntimeError('one\\ntwo')", "ends in RuntimeError: one; it is called with"),
        ("def f(s):\n    return 1.0", "function 'f' ends in TypeError: f() takes 1 positional argument"),
        ("def f(s, p):\n    return s['cold'].only.curvature", "ends in KeyError: 'cold'; it is called with states hot"),
        ("import jax.numpy as jnp\ndef f(s, p):\n    return jnp.ones(3)", "returns float64 of shape (3,)"),
        ("def f(s, p):\n    return None", "must return one real number, but it returns None"),
        ("def f(s, p):\n    return 'bend'", "must return one real number, but it returns bend"),
        ("def f(s, p):\n    return 10**30", "must return one real number, but it returns 1000000"),
        ("def f(s, p):\n    return s['hot'].only.curvature > 3", "returns bool of shape ()"),
        ("def f(s, p):\n    return s['hot'].only.curvature * 1j", "returns complex128 of shape ()"),
        ("import math\ndef f(s, p):\n    return math.sin(s['hot'].only.curvature)", "make all of it with jax.numpy"),
    ],
)  # fmt: skip
def test_a_function_that_cannot_be_used_is_refused_in_one_line_and_leaves_nothing(code, words, tmp_path):
    path = write_study(tmp_path, changed(BEND, FUNCTION, PLAIN))
    (tmp_path / "mine.py").write_text(code + "\n")
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        run_study(read_study(path), tmp_path / "new" / "out" / "evaluations.jsonl")
    assert "\n" not in str(caught.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mine.py", "study.toml"]


def test_a_file_that_leaves_the_program_is_refused(tmp_path):
    (tmp_path / "mine.py").write_text("import sys\nsys.exit(3)\n")
    with pytest.raises(InputError, match="cannot be executed \\(SystemExit: 3\\)"):
        read_study(write_study(tmp_path, changed(BEND, FUNCTION)))


@pytest.mark.parametrize("earlier", [True, False])
def test_a_refusal_leaves_evaluations_of_an_earlier_run(earlier, tmp_path):
    path = tmp_path / "new" / "evaluations.jsonl"
    if earlier:
        Log(path, "a study").add(0, np.zeros((1, 2)), np.ones((1, 3)), np.ones((1, 3, 2)))
    log = Log(path, "a study")
    log.add(0, np.ones((1, 2)), np.ones((1, 3)), np.ones((1, 3, 2)))
    log.discard()
    assert path.exists() is earlier and path.parent.exists() is earlier


def _posterior(path, names):
    with h5py.File(path, "w") as file:
        for k, name in enumerate(names):
            data = file.create_dataset(f"posterior/{name}", data=np.full((2, 3), 1e-3 + 1e-4 * k))
            data.attrs["unit"] = "m"
    return path


def test_of_a_posterior_of_several_specimens_one_has_to_be_named(tmp_path):
    two = _posterior(tmp_path / "two.nc", ["wall_thickness__1", "wall_thickness__2"])
    with pytest.raises(InputError, match="several specimens: add posterior_specimen = 1"):
        posterior_draws(two)
    with pytest.raises(InputError, match="posterior_specimen is 3, known: 1, 2"):
        posterior_draws(two, 3)
    assert posterior_draws(two, 2)[0]["wall_thickness"] == pytest.approx(1.1e-3)
    one, others = posterior_draws(_posterior(tmp_path / "one.nc", ["wall_thickness__1", "offset"]))
    assert others == ("offset",)
    assert list(one) == ["wall_thickness"] and one["wall_thickness"] == pytest.approx(1e-3)


@pytest.mark.parametrize("draw", [np.nan, np.inf, 1e308])
def test_a_draw_that_is_not_finite_is_refused(tmp_path, draw):
    path = _posterior(tmp_path / "one.nc", ["G_m"])
    with h5py.File(path, "r+") as file:
        file["posterior/G_m"][1, 2] = draw
        file["posterior/G_m"].attrs["unit"] = "GPa"  # so that 1e308 is more than a number can be
    with pytest.raises(InputError, match="draws of G_m are not finite"):
        posterior_draws(path)


def test_the_command_says_it_on_one_line_and_writes_nothing(tmp_path):
    path = write_study(tmp_path, changed(WALL, WALL.replace("0.7", "2.7")))
    done = CliRunner().invoke(main, ["design", str(path), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert done.stderr.count("\n") == 1 and "wall_thickness: bounds are crossed" in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_misspelt_material_of_a_design_is_told_with_the_designs_file(tmp_path):
    """The study was blamed, which names no material."""
    text = (resources.files("calibration_data") / "pneusma2.toml").read_text()
    (tmp_path / "mine.toml").write_text(text.replace('material = "dragon_skin_10_fast"', 'material = "dragon_skin_10_fst"'))
    study = write_study(tmp_path, changed('"pneusma2"', '"mine.toml"'))
    with pytest.raises(InputError) as caught:
        read_study(study)
    assert str(caught.value).startswith(f"{tmp_path / 'mine.toml'}: material = 'dragon_skin_10_fst': ")
