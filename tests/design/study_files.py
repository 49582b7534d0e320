"""Studies that tests are made of."""

from pathlib import Path

SMALL = """
schema = "pneusma-study/1"
name = "small"
design = "pneusma2"
starts = 3

[free]
wall_thickness = {made = "continuous", from = 0.7, to = 1.6, unit = "mm"}
active_coils = {made = "integer", from = 40, to = 70}

[state.hot]
pressure = {value = 30, unit = "kPa"}
xi0_2 = 0.3

[objective.bend]
quantity = "curvature"
goal = "maximise"
state = "hot"

[constraint.length]
quantity = "length"
at_most = {value = 58.3, unit = "mm"}
[constraint.shear]
quantity = "shear_strain"
at_most = "tested"
"""

PLAIN = """
schema = "pneusma-study/1"
name = "plain"
design = "pneuflex_s"
starts = 3

[free]
wall_thickness = {made = "continuous", from = 0.7, to = 1.6, unit = "mm"}

[state.hot]
pressure = {value = 30, unit = "kPa"}

[objective.bend]
quantity = "curvature"
goal = "maximise"
state = "hot"

[constraint.length]
quantity = "length"
at_most = {value = 90, unit = "mm"}
"""
"""A tube without springs, whose program compiles in a third of the time."""

CHAIN = """
schema = "pneusma-chain/1"
name = "two"

[[segment]]
design = "pneusma2"
connector = {value = 4.0, unit = "mm", status = "assumed", source = "test"}

[[segment]]
design = "pneusma2"
"""


def write_study(folder: Path, text: str = SMALL) -> Path:
    """A study in a folder."""
    path = folder / "study.toml"
    path.write_text(text)
    return path


def changed(old: str, new: str, text: str = SMALL) -> str:
    """A study with one thing different."""
    assert old in text, old
    return text.replace(old, new, 1)
