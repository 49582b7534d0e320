"""`pneusma synthesise`: files, repeatability, refusals."""

import json

import pytest

from fitting.data.recordings import read_campaign


def test_a_campaign_is_written_with_its_truth(run, tmp_path):
    out = tmp_path / "made"
    arguments = (
        "synthesise",
        "tube",
        "--out",
        out,
        "--seed",
        3,
        "--truth",
        "silicone_stiffness=1.2",
        "--tests",
        1,
    )
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    truth = json.loads((out / "truth.json").read_text())
    assert truth["schema"] == "pneusma-truth/1" and truth["simulated"] is True
    assert truth["specimens"]["A"]["silicone_stiffness"]["value"] == 1.2
    assert [r.name for r in read_campaign(out).recordings] == ["inflation_1", "inflation_2"]
    assert "2 recordings" in result.stdout and f"wrote {out / 'truth.json'}" in result.stdout
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    assert run(*arguments, "--force").exit_code == 0
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before


def test_a_blind_campaign_has_no_truth(run, tmp_path):
    assert run("synthesise", "elastomer", "--out", tmp_path / "x", "--hide-truth").exit_code == 0
    assert sorted(p.name for p in (tmp_path / "x").iterdir())[0] == "campaign.toml"
    assert not (tmp_path / "x" / "truth.json").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("cube",), "no campaign of kind 'cube'"),
        (("tube", "--truth", "wall=1"), "no such number"),
        (("tube", "--truth", "wall"), "must be NAME=VALUE"),
        (("tube", "--truth", "a=1", "--truth", "a=2"), "given twice"),
        (("tube", "--noise", "length=0.1"), "did you mean 'length_mm'?"),
        (("tube", "--seed", -1), "-1 is not in the range x>=0"),
        (("actuator", "--design", "pneusma9"), "pneusma"),
        (("wire", "--alloy", "nowhere.toml"), "no such file"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_written(refused, tmp_path, arguments, words):
    kind, *options = arguments
    assert words in refused("synthesise", kind, "--out", tmp_path / "x", *options)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_use_is_refused(refused, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    assert "not empty" in refused("synthesise", "tube", "--out", tmp_path)
