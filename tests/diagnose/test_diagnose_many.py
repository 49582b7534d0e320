"""Many campaigns through one engine: each is a file, what is done stays, one that fails stops none."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import fitting.diagnose.batch
from fitting.cli import main
from fitting.diagnose.batch import Asked, Diagnosed, Diagnoses, diagnose_batch, job_of
from fitting.engine import Store
from fitting.report.diagnosis.batch import _row, report_of
from fitting.report.results import save, text
from fitting.synthesise import synthesise, write_synthetic
from pneusma_jax.errors import InputError


@pytest.fixture
def strips(tmp_path):
    for seed in (1, 2):
        write_synthetic(synthesise("elastomer", seed=seed), tmp_path / f"strip_{seed}")
    return [tmp_path / "strip_1", tmp_path / "strip_2"]


@pytest.fixture
def asked_for(monkeypatch):
    """Campaigns that were diagnosed; the diagnosis itself is made up."""
    seen = []

    def diagnose(campaign, seed, progress, start, thorough, effects):
        seen.append(campaign.path.name)
        progress("thinking")
        return SimpleNamespace(notes=["read it with care"])

    monkeypatch.setattr(fitting.diagnose.batch, "diagnose", diagnose)
    return seen


def present(conclusion, title, command, seed, start):
    """A report that names friction, and the command that makes it again."""
    sizes = {"constant": {"value": 2e-4, "sd": 3e-4, "unit": "N m"}}
    doubtful = "strip_2" in command
    effects = [{"name": "wrap_friction", "probability": 0.35 if doubtful else 0.97, "tentative": doubtful,
                "strength": "constant", "parameters": sizes}]  # fmt: skip
    fit = {"before": {"reduced_chi2": 9.0}, "after": {"reduced_chi2": 1.1}}
    content = {"verdict": "mismatch", "effects": effects, "fit": fit, "command": command}
    return ["A mismatch."], {"report.json": json.dumps(content).encode(), "figure.png": b"\x89PNG"}


def test_every_campaign_is_diagnosed_once_whatever_ends_the_run(strips, asked_for, tmp_path):
    store, steps, kept = Store(tmp_path / "out" / "diagnosed"), [], []
    diagnose_batch(job_of(strips[:1], tmp_path / "out", Asked(3), present), store, progress=steps.append)
    assert asked_for == ["strip_1"] and "strip_1: thinking" in steps
    job = job_of(strips, tmp_path / "out", Asked(3), present)
    both = diagnose_batch(job, store, kept=lambda member: kept.append(member.name))
    assert asked_for == ["strip_1", "strip_2"] and kept == ["strip_1"]
    again = diagnose_batch(job, store)
    assert len(asked_for) == 2 and again.documents() == both.documents()
    diagnose_batch(job_of(strips, tmp_path / "out", Asked(4), present), store)
    assert len(asked_for) == 4, "another seed is another diagnosis"
    command = both.members[0].content["command"]
    assert command == f"pneusma diagnose {strips[0]} --out {tmp_path / 'out' / 'strip_1'} --seed 3"


def test_one_that_cannot_be_read_stops_no_other_and_is_tried_again(strips, asked_for, tmp_path):
    store, nowhere = Store(tmp_path / "diagnosed"), tmp_path / "nothing"
    job = job_of([nowhere, *strips], tmp_path, Asked(), present)
    result = diagnose_batch(job, store)
    assert [member.done for member in result.members] == [False, True, True]
    said = " ".join(text(result).split())
    assert "2 of 3 campaigns were diagnosed" in said and "nothing was not diagnosed" in said
    assert "Named first: wrap friction (1). Named first with a perhaps: wrap friction (1)." in said
    assert _row(result.members[2])[2] == "perhaps wrap friction 0.35 (constant = 0.00020 ± 0.00030 N m)"
    write_synthetic(synthesise("elastomer", seed=3), nowhere)
    assert all(member.done for member in diagnose_batch(job, store).members)
    assert asked_for == ["strip_1", "strip_2", "nothing"]
    files = {path.name for path in save(result, tmp_path / "table")}
    assert files == {"report.html", "report.json", "campaigns.csv"}
    rows = [line.split(",") for line in (tmp_path / "table" / "campaigns.csv").read_text().splitlines()]
    place = [rows[0].index(name) for name in ("effect", "tentative", "strength", "value", "standard_error", "unit")]
    assert [rows[3][k] for k in place] == ["wrap_friction", "True", "constant", "0.0002", "0.0003", "N m"]
    with pytest.raises(InputError, match="none of 1 campaign could be diagnosed"):
        diagnose_batch(job_of([tmp_path / "table"], tmp_path, Asked(), present), store)


def test_a_job_on_another_machine_gives_the_same_bytes(strips, asked_for, tmp_path):
    job = job_of(strips, tmp_path, Asked(), present)
    elsewhere = lambda work, numbers: ((k, work(k)) for k in reversed(numbers))  # noqa: E731
    here, there = Store(tmp_path / "here"), Store(tmp_path / "there")
    diagnose_batch(job, here)
    diagnose_batch(job, there, elsewhere)
    assert [here.read(task) for task in job.tasks()] == [there.read(task) for task in job.tasks()]


def test_options_of_several_are_refused_for_one(strips, tmp_path):
    done = CliRunner().invoke(main, ["diagnose", str(strips[0]), "--out", str(tmp_path / "out"), "--resume"])
    assert done.exit_code == 2 and "for several campaigns" in done.stderr


@pytest.mark.slow
def test_the_command_leaves_a_folder_for_each_and_a_table(strips, tmp_path):
    out = tmp_path / "out"
    arguments = ["diagnose", *map(str, strips), str(tmp_path / "missing"), "--out", str(out), "--seed", "1"]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 1 and "missing" in done.stderr, done.output
    for strip in strips:
        assert {"report.html", "report.json", "augmented.toml"} <= {
            p.name for p in (out / strip.name).iterdir()
        }
    alone = CliRunner().invoke(
        main, ["diagnose", str(strips[0]), "--out", str(tmp_path / "one"), "--seed", "1"]
    )
    assert alone.exit_code == 0
    one, many = (json.loads((f / "report.json").read_text()) for f in (tmp_path / "one", out / "strip_1"))
    assert one == many
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert CliRunner().invoke(main, [*arguments, "--resume"]).exit_code == 1
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_notes_beside_the_verdicts_end_in_one_stop():
    member = Diagnosed("a", Path("a"), ("Nothing.",), ("it scatters. A misfit may be hidden.", "no clock"))
    found = report_of(Diagnoses((member,), 0))
    (points,) = [section.blocks[0] for section in found.sections if section.title == "Notes"]
    assert points.items == ["a: it scatters. A misfit may be hidden.", "a: no clock."]
