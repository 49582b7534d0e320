"""Every package that the project names has a reason beside it, and a line among the oldest and the newest versions."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
RUN = [*PROJECT["dependencies"], *EXTRAS["uq"], *EXTRAS["cluster"], *EXTRAS["test"], *EXTRAS["benchmarks"]]


def plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", re.split(r"[\[<>=!~ ]", name)[0]).lower()


def pinned(file: str) -> dict[str, str]:
    lines = [line.split("==") for line in (ROOT / file).read_text().splitlines() if "==" in line]
    return {plain(name): version for name, version in lines}


def version(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text))


@pytest.mark.parametrize("requirement", RUN)
def test_the_oldest_version_is_the_one_that_the_project_states(requirement):
    oldest, floor = pinned("tests/constraints-oldest.txt"), requirement.split(">=")[1]
    assert version(oldest[plain(requirement)])[: len(version(floor))] == version(floor) or (
        version(floor) < version(oldest[plain(requirement)])
    )
    assert plain(requirement) in pinned("constraints.txt")


def test_every_direct_dependency_says_why_it_is_there():
    text = (ROOT / "pyproject.toml").read_text()
    for requirement in PROJECT["dependencies"]:
        assert re.search(rf'^    "{re.escape(requirement)}",  # \w+', text, flags=re.M), requirement
