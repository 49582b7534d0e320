"""A silicone law with named parameters: its constants, as in the tables, and a factor on its stress."""

from collections.abc import Callable, Mapping
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign, Recording
from fitting.inference.parameters import Parameters
from pneusma_jax.calibration import load_calibration
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.silicone import Gent, NeoHookean, Ogden, PolynomialFit, SiliconeLaw, Yeoh, load_silicone

from . import priors
from .row_builders import columns_of, measured_and_weight
from .rows import CLEAN, Rows
from .specimen import RowOptions, Specimen

FACTOR = "silicone_stiffness"
UNITS = {FACTOR: "1"}
DEFAULT = "dragon_skin_10_fast"
"""Default table that a material starts from when it is to be fitted."""
UNKNOWN = 0.4
"""Relative standard deviation of the stiffness of a silicone that is to be fitted [1]."""
AMONG_SPECIMENS = 0.1
"""Minimum relative standard deviation of stiffness among specimens of a silicone whose law is so open [1].

In a public database of 19 cast mixtures two cylinders of each differ by 0 to 7 %. Strips that are cut by hand
have a doubtful cross-section as well."""
NEARLY = 0.99
"""Share of `UNKNOWN` from which a modulus is as open as that [1]; rounding may make it a little less."""
SINGLE = {NeoHookean: ("mu",), Yeoh: ("c_10", "c_20", "c_30"), Gent: ("mu", "j_m")}


class Scaled(SiliconeLaw):
    """A law whose stress is multiplied by a factor [1]."""

    law: SiliconeLaw
    factor: Array

    def __call__(self, strain: Array) -> Array:
        """Engineering stress [Pa] at an engineering strain [1]."""
        return self.factor * self.law(strain)

    @property
    def cuts(self) -> Array:
        """Strains where the law is not smooth, ascending, shape (n,)."""
        return self.law.cuts


def constants(law: SiliconeLaw) -> dict[str, float]:
    """Constants of a law that may be free, by name, SI. The actuator's joined polynomials have none."""
    if type(law) in SINGLE:
        return {name: float(getattr(law, name)) for name in SINGLE[type(law)]}
    if isinstance(law, Ogden):
        pairs = {"mu": np.ravel(law.mu), "alpha": np.ravel(law.alpha)}
        return {f"{stem}_{k}": float(x) for stem, row in pairs.items() for k, x in enumerate(row, 1)}
    if isinstance(law, PolynomialFit):
        return {f"p_{k}": float(x) for k, x in enumerate(np.ravel(law.coefficients), 1)}
    return {}


def packed(law: SiliconeLaw) -> SiliconeLaw:
    """A law whose arrays get a leading axis of one, so that none is as long as a recording."""
    return jax.tree.map(lambda leaf: np.asarray(leaf, float)[None], law)


def law_with(packed_law: SiliconeLaw, parameters: Mapping[str, Array]) -> Scaled:
    """The law of `packed`, with constants and factor from a model's parameters."""
    law = jax.tree.map(lambda leaf: leaf[0], packed_law)
    if type(law) in SINGLE:
        law = type(law)(*(parameters[name] for name in SINGLE[type(law)]))
    elif isinstance(law, Ogden):
        terms = range(1, law.mu.shape[0] + 1)
        law = Ogden(*(jnp.stack([parameters[f"{stem}_{k}"] for k in terms]) for stem in ("mu", "alpha")))
    elif isinstance(law, PolynomialFit):
        numbers = jnp.stack([parameters[f"p_{k}"] for k in range(1, law.coefficients.shape[0] + 1)])
        law = eqx.tree_at(lambda p: p.coefficients, law, numbers)
    return Scaled(law, parameters[FACTOR])


def law_of(campaign: Campaign, material: str | Path | None = None) -> tuple[SiliconeLaw, bool]:
    """The one law of a campaign's material, and a flag that is true if it is to be identified.

    Args:
        campaign: recordings of one kind.
        material: table to start from, in place of the named one or of `DEFAULT`.

    Raises:
        InputError: if the recordings name several materials, or one that cannot be loaded.
    """
    name = campaign.recordings[0].table("material")
    base = material or (DEFAULT if str(name) == priors.FIT else None)
    table, identify = priors.table_of(campaign, "material", base)
    return _stated_law(campaign.recordings[0], base or name, table.text.get("law")), identify


def _stated_law(recording: Recording, name: str | Path, own: str | None) -> SiliconeLaw:
    """Law that a recording states for a simulation; the table's own where it states none."""
    stated = recording.geometry.get("law")
    if stated is None or stated == own or (stated == "polynomial" and own == "regularised"):
        return load_silicone(name)
    return load_silicone(name, stated)


def material_parameters(campaign: Campaign, law: SiliconeLaw, identify: bool, base: str | Path) -> Parameters:
    """Free constants of the law. All specimens share them; the factor belongs to each specimen.

    A material that is to be identified has the priors of its table. A known one is free as far as
    `[tolerance]` says.
    """
    values, parameters = constants(law), Parameters()
    table = load_calibration(base, "silicone").quantities
    if identify:
        for name in values:
            if name in table and table[name].prior is not None:
                parameters.add(priors.tabulated(table[name]))
        return parameters
    for name, relative in priors.tolerances(campaign.recordings, values).items():
        unit = table[name].unit if name in table else "1"
        parameters.add(priors.toleranced(name, values[name], relative, unit))
    return parameters


def always_open(campaign: Campaign, identify: bool, law: Parameters) -> dict[str, float]:
    """Relative standard deviation of the stress factor of a silicone to be fitted.

    A law whose moduli are as open as its stiffness has that stiffness for all specimens. Their factors are
    then what they differ by, at least; a tolerance may say more. So a specimen that is only predicted is as
    stiff as those that were fitted. Beside any other law the factor has the stiffness that nobody knows.

    Args:
        campaign: recordings of one kind.
        identify: true if the silicone is to be fitted.
        law: free constants of its law.
    """
    if not identify:
        return {}
    moduli = [p for name, p in law.items() if QUANTITIES["silicone"].get(name) == "pressure"]
    known = [p for p in moduli if p.prior is None or p.prior.sd < NEARLY * UNKNOWN * abs(p.prior.mean)]
    if not moduli or known:
        return {FACTOR: UNKNOWN}
    return {FACTOR: max(AMONG_SPECIMENS, priors.tolerances(campaign.recordings, [FACTOR]).get(FACTOR, 0.0))}


def table_name(campaign: Campaign, material: str | Path | None = None) -> str | Path:
    """Table of the material's constants."""
    name = campaign.recordings[0].table("material")
    return material or (DEFAULT if str(name) == priors.FIT else name)


Sizes = Callable[[Recording], dict[str, float]]
"""Dimensions of a recording's specimen by name, SI."""
Weighing = Callable[[Recording, Mapping[str, np.ndarray], np.ndarray, int], np.ndarray]
"""Function that adjusts the weight of an output, from the recording, its columns, the weight and the number
of readings in a row."""


def rows_of_silicone(
    campaign: Campaign,
    options: RowOptions,
    material: str | Path | None,
    specimen: Specimen,
    sizes: Sizes,
    weighing: Weighing | None = None,
) -> list[Rows]:
    """Arrays of recordings of one silicone, with one driver and one output.

    Args:
        campaign: recordings of one kind.
        options: selection of rows.
        material: table to start from, as for `law_of`.
        specimen: specimen of that kind.
        sizes: function from a recording to the dimensions that may be free, SI.
        weighing: function that adjusts the output's weight; None leaves it.

    Raises:
        InputError: if the recordings name several materials, or one has too few complete rows.
    """
    law, _ = law_of(campaign, material)
    number = {name: k for k, name in enumerate(campaign.specimens(), start=1)}
    (output,) = specimen.outputs
    result = []
    for recording in campaign.recordings:
        (driver,) = specimen.drivers(recording)
        columns, block = columns_of(recording, (driver,), (output,), options)
        measured, weight = measured_and_weight(recording, (output,), columns, block, options)
        clean = dict(weight)
        if weighing is not None:
            weight[output] = weighing(recording, columns, weight[output], block)
        base = sizes(recording) | {FACTOR: 1.0} | constants(law)
        result.append(
            Rows(
                mask=np.ones(len(columns["time"]), bool),
                time=columns["time"],
                inputs={driver: columns[driver]},
                measured=measured,
                weight=weight,
                base={name: np.asarray(value) for name, value in base.items()},
                extra={"law": packed(law), CLEAN: clean},
                specimen=np.asarray(number[recording.specimen]),
            )
        )
    return result


def parameters_of_silicone(campaign: Campaign, material: str | Path | None, sizes: Sizes) -> Parameters:
    """Free parameters with their priors: constants of the silicone, then each specimen's factor and
    dimensions.

    Args:
        campaign: recordings of one kind.
        material: table to start from, as for `law_of`.
        sizes: function from a recording to the dimensions that may be free, SI.
    """
    law, identify = law_of(campaign, material)
    parameters = material_parameters(campaign, law, identify, table_name(campaign, material))
    free = lambda recording: sizes(recording) | {FACTOR: 1.0}  # noqa: E731
    stiffness = always_open(campaign, identify, parameters)
    parameters.update(priors.geometry_parameters(campaign, free, UNITS, stiffness))
    return parameters
