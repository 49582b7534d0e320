"""Statements that could not act, and tolerances of which no specimen can be made, are refused in one line."""

import pytest
from study_files import PLAIN, SMALL, changed, write_study

from fitting.design import read_study
from pneusma_jax.errors import InputError

DESIGN = 'design = "pneuflex_s"'


def tolerance(name: str, size: str) -> str:
    return f'\n[uncertainty]\ndraws = 8\n[uncertainty.tolerance]\n{name} = {{{size}, unit = "mm"}}\n'


@pytest.mark.parametrize(("text", "said"), [
    (changed(DESIGN, f'{DESIGN}\nalloy = "krl35"', PLAIN), "alloy = 'krl35' is of no use, since no design has a spring"),
    (f'{PLAIN}\n[uncertainty]\npriors = ["alloy", "silicone"]\n', "priors of the alloy are of no use"),
    (PLAIN + tolerance("wall_thickness", "sd = 0.2"), "tolerance.wall_thickness: it makes -0.1 mm of 0.7 mm, but wall_thickness must be positive"),
    (PLAIN + tolerance("wall_thickness", "half_width = 0.7"), "it makes 0 mm of 0.7 mm"),
    (PLAIN + tolerance("outer_diameter", "sd = 30"), "tolerance.outer_diameter: it makes -110 mm of 10 mm"),
])  # fmt: skip
def test_what_could_not_act_or_be_made_is_refused(tmp_path, text, said):
    with pytest.raises(InputError) as refused:
        read_study(write_study(tmp_path, text))
    assert said in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("text", [
    changed('design = "pneusma2"', 'design = "pneusma2"\nalloy = "krl35"'),
    f'{SMALL}\n[uncertainty]\npriors = ["alloy"]\n',
    PLAIN + tolerance("wall_thickness", "sd = 0.03"),
])  # fmt: skip
def test_what_acts_is_read(tmp_path, text):
    assert read_study(write_study(tmp_path, text)).free
