"""Tests by which a laboratory tells explanations apart, in words."""

from collections.abc import Sequence

SEPARATE = {
    "opposing_spring_heating": "swap which spring is heated and measure the resistance of the other one as "
    "well",
    "tip_contact": "reach the same bend angle by another pressure and look for the kink at the same angle",
    "gravity": "repeat one recording with the actuator rolled by 180 degrees",
    "wrap_friction": "repeat one pressure cycle ten times slower: friction keeps its loop, rate effects "
    "change theirs",
    "mullins_softening": "exceed the previous largest strain once and repeat the earlier cycles",
    "viscoelastic_relaxation": "make a fast step, hold it for several minutes, and unload as fast",
    "permanent_set": "leave the specimen unloaded overnight and measure its rest length again",
    "strain_stiffening": "pull the silicone alone to the largest strain of these recordings",
    "wall_eccentricity": "pressurise the cold, symmetric actuator, and again rolled by 180 degrees",
    "thick_wall": "pull the capped tube at several constant pressures",
    "radial_expansion": "measure the outer diameter under pressure",
    "pressure_calibration": "vent to zero at the beginning and at the end, and compare with a second gauge",
    "pressure_lag": "put a second pressure sensor at the chamber and step the pressure",
    "series_resistance": "measure one spring with four wires, or heat it fully past its transformation",
    "resistance_temperature_coefficient": "hold the wire fully austenitic and vary its temperature",
    "detwinned_resistivity_memory": "heat past the end of transformation after the pre-strain and repeat the "
    "pull",
    "r_phase": "record resistance over temperature without load, heating and cooling",
    "transformation_hysteresis": "make partial cycles that turn round inside the loop",
    "stress_shifted_transformation": "record the same thermal cycle at two loads",
    "cyclic_shakedown": "make ten cycles of pressure alone and ten of heat alone",
    "tension_compression_asymmetry": "push and pull the same spring",
    "coil_contact": "pull slowly from the closed spring over the first few millimetres",
    "large_helix_angle": "pull the fully austenitic spring to its longest",
    "inactive_coils": "count and mark the turns that open",
    "prestrain_error": "swap the springs, or measure their rest lengths",
    "uneven_heating": "heat ten times slower, so that the wire is evenly warm",
    "self_heating_rate": "repeat the pull ten times slower",
    "camera_calibration": "photograph a printed arc of known curvature",
    "load_train_compliance": "put a rigid bar in place of the specimen",
    "force_calibration": "hang a known weight at the beginning and at the end",
    "channel_lag": "give all channels one common pulse",
}
SEPARATE_OF = {
    "S": {
        "cyclic_shakedown": "make ten cycles of elongation alone and ten of heat alone",
        "prestrain_error": "measure the spring's rest length, or repeat the recordings with another spring",
        "series_resistance": "measure the spring with four wires, or heat it fully past its transformation",
    },
    "W": {
        "cyclic_shakedown": "make ten cycles of load alone and ten of heat alone",
        "series_resistance": "measure the wire with four wires, or heat it fully past its transformation",
        "tension_compression_asymmetry": "compress a short piece of the wire as well",
    },
    "E": {"strain_stiffening": "pull another specimen to the largest strain of these recordings"},
    "T": {"wall_eccentricity": "pressurise the tube, and again rolled by 180 degrees"},
}
"""The same where a kind of specimen, by its letter, needs other words."""


def to_separate(slug: str, letter: str, otherwise: str = "repeat the recordings at another rate") -> str:
    """Test that shows an effect.

    Args:
        slug: the effect.
        letter: letter of the kind of specimen.
        otherwise: words for an effect without a test of its own.
    """
    return SEPARATE_OF.get(letter, {}).get(slug) or SEPARATE.get(slug, otherwise)


def separating(slugs: Sequence[str], letter: str) -> str:
    """Sentences on how to separate these explanations.

    Args:
        slugs: the effects.
        letter: letter of the kind of specimen.
    """
    first = to_separate(slugs[0], letter)
    if len(slugs) == 1:
        return f"To confirm {slugs[0]}: {first}."
    second = to_separate(slugs[1], letter)
    return f"To tell {slugs[0]} from {slugs[1]}: {first}; for the other, {second}."
