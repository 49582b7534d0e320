"""Alloys of springs on a stand that are taken into an actuator: a note names both pre-strains."""

from types import SimpleNamespace

import pytest

from fitting.calibrate.alloy_table import alloy_table
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.cli import main
from fitting.data.recordings import Recording
from fitting.inference.parameters import Parameters
from fitting.simulate.state import described_actuator
from pneusma_jax.calibration import load_calibration, write_calibration


@pytest.fixture
def found(tmp_path):
    """Writes the table of an alloy that was found with springs which began at such pre-strains."""

    def write(*prestrains):
        table = alloy_table("Our springs", load_calibration("krl35").quantities, Parameters(), False, None, prestrains)
        write_calibration(table, tmp_path / "ours.toml")
        return str(tmp_path / "ours.toml")

    return write


def notices(alloy, **geometry):
    return [note for note in described_actuator(None, {"alloy": alloy, **geometry}).notices if "pre-strain" in note]


def test_an_alloy_of_a_stand_in_an_actuator_names_both_pre_strains(found):
    """Springs of an actuator begin at 0.1924, and nothing said so beside an alloy of a stand, where it is 0."""
    path = found(0.0, 0.0)
    (said,) = notices(path)
    assert said == (
        f"the alloy {path} was found with springs on a stand that began at a pre-strain of 0; "
        "in this actuator springs begin at 0.1924 (prestrain under [geometry] states another)"
    )
    assert "pre-strain of 0, 0.05; in" in notices(found(0.05, 0.0))[0]


def test_nothing_is_said_where_the_pre_strain_is_stated_or_the_same(found):
    assert notices(found(0.0), prestrain=0.1924) == [] == notices(found(0.0), prestrain=0.0)
    assert notices(found(0.1924)) == [] == notices("krl35") == notices(found())


@pytest.mark.parametrize("what", [("--pressure-kPa", "30", "--xi0-2", "0.4"), ("--protocol", "thermal_cycle")])
def test_the_note_is_told_once_by_simulate(found, tmp_path, capsys, what):
    with pytest.raises(SystemExit, match="^0$"):
        main(["simulate", "--design", "pneusma2", "--alloy", found(0.0), *what, "--out", str(tmp_path / "out")])
    assert capsys.readouterr().err.count("began at a pre-strain of 0") == 1


def test_tables_of_springs_on_a_stand_say_so():
    begun = [SimpleNamespace(recording=Recording(str(strain), None, "spring", geometry={"prestrain": strain})) for strain in (0.0, 0.02)]
    result = SimpleNamespace(title="Ours", base=load_calibration("krl35").quantities, fitted=Parameters(), real=None, parameters={}, tests=begun)
    assert SpringCharacterisation.table(result).description == "Alloy of Ours, characterised from tests of springs on a stand, pre-strain 0, 0.02"
