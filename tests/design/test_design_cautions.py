"""A study's page repeats what its tables, its model and its posterior say against their own numbers."""

import json
import warnings
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from study_files import PLAIN, changed, write_study

import fitting.report.results  # noqa: F401  results know how they look
from fitting.data.hdf5 import CAUTION
from fitting.design import read_study, run_study
from fitting.design.bodies import cautions_of, plan_of
from fitting.design.conclude import notes_on_touching
from fitting.report.results import save
from fitting.specimens.saved_models import AugmentedModel
from pneusma_jax.errors import DISTRUSTED, Distrusted

TABLES = Path(str(resources.files("calibration_data")))
WHY = "The law does not fit these tests."


def doubted(folder: Path, name: str, kind: str) -> Path:
    """A shipped table whose numbers are not to be trusted."""
    path = folder / f"{name}.toml"
    path.write_text((TABLES / path.name).read_text().replace(f'kind = "{kind}"\n', f'kind = "{kind}"\ncaution = "{WHY}"\n'))
    return path


def test_tables_of_all_kinds_and_a_model_are_told_once(tmp_path):
    alloy, silicone = doubted(tmp_path, "krl35", "alloy"), doubted(tmp_path, "dragon_skin_10_fast", "silicone")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Distrusted)
        assert cautions_of(plan_of("pneusma2", str(alloy), str(silicone))) == [
            f"{path}: {DISTRUSTED}. {WHY}" for path in (alloy, silicone)
        ]
        model = AugmentedModel(name="mine", caution=WHY)
        assert cautions_of(plan_of("pneusma2", model=model)) == [f"mine: {DISTRUSTED}. {WHY}"]
    assert cautions_of(plan_of("pneusma2")) == []


@pytest.mark.filterwarnings("ignore::pneusma_jax.errors.Distrusted")
def test_the_page_has_them_and_those_of_a_posterior_without_a_front(tmp_path):
    """The sentence on the draws had been told only beside a front of a probability of failure."""
    silicone = doubted(tmp_path, "dragon_skin_10_fast", "silicone")
    with h5py.File(tmp_path / "posterior.nc", "w") as file:
        file.attrs[CAUTION] = "Zeros of instruments are left out."
        draws = file.create_group("posterior").create_dataset(
            "wall_thickness", data=np.random.default_rng(1).normal(1.0, 0.01, (4, 50))
        )
        draws.attrs["unit"] = "mm"
    text = changed('design = "pneuflex_s"', f'design = "pneuflex_s"\nmaterial = "{silicone}"', PLAIN)
    text = changed("starts = 3", "starts = 1", text)
    text += '[uncertainty]\nposterior = "posterior.nc"\ndraws = 8\nfresh_draws = 100\nobjective = "mean"\n'
    result = run_study(read_study(write_study(tmp_path, text)))
    save(result, tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text()
    for said in (f"{DISTRUSTED}. {WHY}", "Zeros of instruments are left out"):
        assert said in page
        assert any(said in note for note in json.loads((tmp_path / "out" / "report.json").read_text())["warnings"])


def test_states_in_which_the_body_may_touch_itself_are_told():
    """A design of 400 degrees had been told without a word."""
    states = [SimpleNamespace(segments=[SimpleNamespace(bend=np.deg2rad([0.0, angle]), length=0.056)],
                              chain=None, body=None) for angle in (100.0, 1400.0)]
    plan = SimpleNamespace(chain=None, model=AugmentedModel(name="base"))
    model = SimpleNamespace(solve_states=lambda place: (None, states), plan=plan)
    assert notes_on_touching(model, np.zeros(1)) == [
        "bent by up to 1400 degrees in 1 of 2 states: past 270 degrees the tip may touch the base, and contact is "
        "not modelled; a constraint on bend_magnitude, at_most 270 deg, forbids it"
    ]
