"""`pneusma effects`: the list, an entry, its figure, and what is refused."""

import csv

import pytest
from click.testing import CliRunner

from fitting.cli import main
from pneusma_jax.effects import CATALOGUE


def run(*words, code=0):
    result = CliRunner().invoke(main, ["effects", *words])
    assert result.exit_code == code, result.output
    return result.output


def test_the_list_names_every_effect_and_its_place():
    listed = run()
    for slug, effect in CATALOGUE.items():
        (line,) = [line for line in listed.splitlines() if line.startswith(slug + " ")]
        assert effect.kinds in line and effect.component in line and effect.sentence in line


def test_an_entry_gives_law_source_and_ranges():
    told = run("opposing_spring_heating")
    assert "Acts at: phase." in told and "3 to 200 s" in told and "Source:" in told


def test_an_entry_has_the_words_of_every_kind():
    told = " ".join(run("wrap_friction").split())
    assert "different paths. The fibre wrapping rubs: the tube lengthens and shortens along different paths (only: tube)." in told
    assert "lengthening over which the friction builds up, over the outer radius (only: tube)" in told


def test_a_signature_is_drawn_with_its_numbers(tmp_path):
    told = run(
        "mullins_softening", "--plot", "--kind", "elastomer", "--set", "depth=0.4", "--out", str(tmp_path)
    )
    assert "largest change of stress_kPa" in told
    assert (tmp_path / "mullins_softening_elastomer.png").read_bytes().startswith(b"\x89PNG")
    lines = (tmp_path / "mullins_softening_elastomer.csv").read_text().splitlines()
    assert "depth = 0.4" in lines[0]
    rows = list(csv.DictReader(lines[1:]))
    below = [float(row["stress_with_effect"]) / float(row["stress_kPa"]) for row in rows[35:50]]
    first = [float(row["stress_with_effect"]) / float(row["stress_kPa"]) for row in rows[5:25]]
    assert max(below) < 0.95 and min(first) == pytest.approx(1.0)


def test_leads_show_on_a_wire_whose_resistance_is_read(tmp_path):
    told = run("series_resistance", "--plot", "--kind", "wire", "--out", str(tmp_path))
    (line,) = [line for line in told.splitlines() if "largest change of strain" in line]
    assert float(line.split()[-1]) > 1e-4


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["tip_contakt"], "did you mean 'tip_contact'"),
        (["gravity", "--plot", "--kind", "tube", "--out", "x"], "does not concern recordings of kind tube"),
        (["gravity", "--plot"], "--plot and --out belong together"),
        (["--plot", "--out", "x"], "name the effect"),
        (["gravity", "--plot", "--out", "x", "--set", "weight=1"], "has no parameter 'weight'"),
        (["gravity", "--plot", "--out", "x", "--set", "mass=1"], "must be 0 to 0.006 kg, not 1"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = run(*words, code=2)
    assert says in told and len(told.strip().splitlines()) == 1
    assert not (tmp_path / "x").exists()
