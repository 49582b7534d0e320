"""Detection of tests that no kind models: membranes, pistons, muscles, grippers, other modes of loading."""

import re
import shlex
from dataclasses import dataclass

from .making import Channel
from .parts import Sample

KINDS_IN_WORDS = (
    "spring (force, elongation, resistance), wire (strain, stress, temperature), elastomer (strain, stress),"
    " tube (pressure, length), actuator (pressure; curvature, bend angle or length)"
)
"""Every kind of recording with its quantities, for messages."""
TORSION = "torsion"
"""Name of a subject that is uncertain: a machine that can twist writes torque and angle of every pull,
too."""
# Subjects by their words in a heading, the preamble, a sheet's or the file's name.
_THINGS: tuple[tuple[str, str], ...] = (
    (
        r"mckibben|artificial muscle|\bpam\b|contraction|muscle|contracted|braid(ed)? angle",
        "the contraction of a pneumatic muscle",
    ),
    (
        r"membrane|diaphragm|bulge|dome height|apex|bubble|balloon|center deflection|centre deflection",
        "an inflated membrane",
    ),
    (r"piston|cylinder stroke|rod force|cylinder force|bellows", "a piston or bellows"),
    (
        r"grip(per)? force|grasp|blocked force|blocking force|fingertip force|tip force",
        "a gripper or the blocked force of an actuator",
    ),
    (r"torque|torsion|twist", TORSION),
    (r"heat flow|\bdsc\b", "a calorimeter scan"),
    (r"storage modulus|loss modulus|tan delta|tan\(delta\)", "a dynamic mechanical analysis"),
)
_MODES: tuple[tuple[str, str], ...] = (
    (r"equi-?biaxial|biaxial", "biaxial tension"),
    (r"pure[ _-]?shear|planar[ _-]?(tension|shear)", "pure shear"),
    (r"simple[ _-]?shear|lap[ _-]?shear|\bshear (strain|stress)", "shear"),
    (
        r"\bbending strain|flexur(e|al)|flexion|\bflex\b|biegeversuch|biegeprüfung"
        r"|three[ _-]?point|3[ _-]?point",
        "bending",
    ),
)  # fmt: skip


@dataclass(frozen=True)
class UnmodelledTest:
    """Subject that a file mentions, and a flag that is true if its columns leave no doubt."""

    sentence: str
    certain: bool


def unmodelled(sample: Sample, channels: dict[str, Channel]) -> UnmodelledTest | None:
    """Sentence about a recording of something that no kind holds, or None where nothing indicates it."""
    grid = sample.require_grid()
    headings = " | ".join(heading.text for heading in grid.headings).lower()
    above = "\n".join(" ".join(row) for row in grid.preamble).lower()
    around = f"{above}\n{sample.title}\n{sample.sheet}\n{sample.raw.path.stem.replace('_', ' ')}".lower()
    for pattern, what in _MODES:
        if re.search(pattern, headings) or re.search(pattern, around):
            return UnmodelledTest(
                f"this speaks of {what}; an elastomer or wire recording is uniaxial. If this one is, state"
                " --kind elastomer"
                f" (or wire). The kinds that are modelled: {KINDS_IN_WORDS}",
                True,
            )
    for pattern, what in _THINGS:
        if re.search(pattern, headings) or re.search(pattern, around):
            if what == TORSION and channels.keys() & {"force", "stress"}:
                continue
            return UnmodelledTest(_sentence(f"this looks like {what}"), bool(re.search(pattern, headings)))
    if "pressure" in channels and channels.keys() & {"force", "elongation", "strain"}:
        other = " and ".join(sorted(channels.keys() & {"force", "elongation", "strain"}))
        sentence = _sentence(f"pressure with {other} is that of a muscle, piston or membrane")
        if other == "elongation":
            stated = sample.sizes.keys() & {"length_mm", "free_length_mm", "length"}
            sentence += ". Of a tube: --kind tube"
            sentence += "" if stated else ", and its length at rest, --dimension length_mm=..."
        elif "strain" in channels:
            sentence += "; of a tube write its length in mm into the file: that at rest, times 1 + strain"
            if "force" not in channels:
                sentence += f"; {if_a_stress(channels['pressure'].label)}"
        return UnmodelledTest(sentence, False)
    return None


def if_a_stress(label: str) -> str:
    """What to state about a pressure beside a strain that is a stress, by the label of its column."""
    return (
        f"of a coupon the stress is missing: if {label!r} is one (P of Piola and Kirchhoff), --map"
        f" stress={shlex.quote(label)}"
    )


def _sentence(what: str) -> str:
    return (
        f"{what}, which is not a kind that is modelled; those that are: {KINDS_IN_WORDS}."
        " If it is one of them after all, state --kind and"
        " name the columns with --map QUANTITY=COLUMN"
    )
