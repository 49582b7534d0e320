"""Format: two columns without header, with nominal stress and stretch, as in the literature on rubber."""

from dataclasses import replace

import numpy as np

from ..recordings import Recording
from ..recordings.kinds import FARTHEST_STRETCH
from ..recordings.table import unusable
from .assemble import Facts, assemble
from .channels import numbered
from .format import Format
from .names import slug
from .options import Options
from .parts import Sample
from .strain_unit import unit_assumed

NAME = "stress-stretch"
DEFAULT_UNIT = "MPa"
NEAR_REST = 0.5  # Maximum distance of some reading from a stretch of one; beyond it the column is no stretch
# Folders of such collections name the mode of loading, which the numbers do not show.
_OTHER_MODES = {
    "ET": "equibiaxial tension",
    "PS": "pure shear",
    "BT": "biaxial tension",
    "Biaxial_tension": "biaxial tension",
}


def _signs_agree(stretch: np.ndarray, stress: np.ndarray) -> bool:
    """True if a stretch is positive and begins near one, and stress is tensile above one and compressive
    below."""
    if np.abs(stretch - 1.0).min() > NEAR_REST or stretch.max() > FARTHEST_STRETCH:
        return False
    slack = 0.02 * np.abs(stress).max()
    pulls = (stretch >= 1.0) & (stress >= -slack)
    pushes = (stretch <= 1.0) & (stress <= slack)
    return bool(stretch.min() > 0.0 and (pulls | pushes).all())


def _orders(sample: Sample) -> list[tuple[str, str]]:
    """Possible orders of the two columns, the usual one first."""
    if not sample.headerless(2) or not np.isfinite(sample.grid.values).all():
        return []
    first, second = sample.grid.values.T
    orders = [("stress", "stretch")] if _signs_agree(second, first) else []
    return orders + ([("stretch", "stress")] if _signs_agree(first, second) else [])


def recognises(sample: Sample) -> bool:
    """True for two columns of numbers, one a stretch and the other a stress of matching sign."""
    return bool(_orders(sample))


def read(sample: Sample, options: Options) -> Recording:
    """An elastomer coupon in uniaxial loading, strain = stretch - 1. Other modes of loading are refused."""
    grid = sample.require_grid()
    path = sample.raw.path.resolve()
    mode = next((_OTHER_MODES[part] for part in path.parts[-3:-1] if part in _OTHER_MODES), None)
    orders = _orders(sample)
    if mode:
        raise unusable(
            sample.raw.path, f"its folder says {mode}; an elastomer recording is uniaxial. If this one is,"
            " name its columns: --map stress=1 --map stretch=2 --unit stress=MPa --kind elastomer",
        )  # fmt: skip
    order = orders[0]
    channels = numbered(grid, order)
    notices = [*grid.notices, f"columns without names, taken as {order[0]}, {order[1]} of a uniaxial test"]
    if len(orders) == 2:
        notices.append(
            "the other order of the two columns makes sense too; name them with --map if it is the right one"
        )
    if "stress" not in options.units:
        channels["stress"] = replace(channels["stress"], unit=DEFAULT_UNIT)
        notices.append(unit_assumed(channels, DEFAULT_UNIT))
    specimen = slug("_".join(path.parts[-3:-1])) if path.parent.name in ("UT", "UC") else slug(path.stem)
    return assemble(
        sample,
        channels,
        options.kind or "elastomer",
        options,
        Facts(NAME, specimen=specimen),
        notices,
    )


FORMAT = Format(NAME, "no header; nominal stress and stretch in two columns -> elastomer", recognises, read)
