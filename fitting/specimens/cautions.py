"""Warnings about results that rest on extrapolation or on an uninformative reading."""

from collections.abc import Mapping
from typing import Any

import numpy as np

import pneusma_jax as pj
from pneusma_jax.effects.body import TipContact
from pneusma_jax.nitinol import SpringResponse
from pneusma_jax.serial_chain.shape import ChainShape
from pneusma_jax.silicone import PolynomialFit, RegularisedSilicone, SiliconeLaw

from .saved_models import AddedEffect, AugmentedModel
from .silicones import Scaled

CLEARANCE_DEG = 270.0
"""Bend angle beyond which the source saw the tip touch the clamp (Section 3.7.2) [deg]."""


def _rows_text(mask: np.ndarray) -> str:
    """List of rows in words; empty for a single state."""
    mask = np.atleast_1d(mask)
    return "" if mask.size == 1 else f" in {int(mask.sum())} of {mask.size} rows"


def _warnings(conditions: dict[str, np.ndarray]) -> list[str]:
    return [sentence + _rows_text(mask) for sentence, mask in conditions.items() if np.any(mask)]


def spring_cautions(
    spring: pj.Spring, response: SpringResponse, name: str, read: SpringResponse | None = None
) -> list[str]:
    """Warnings where a resistance does not determine the martensite fraction, or where a law is extrapolated.

    Args:
        spring: the spring element.
        response: response of one state or of rows.
        name: name of the spring in the sentence, such as `"spring 2"`.
        read: response to the resistance as measured, where `response` belongs to a denoised one.
    """
    gamma = np.asarray(response.gamma)
    source = response if read is None else read
    clipped, degenerate = np.asarray(source.clipped), np.asarray(source.degenerate)
    limit = float(spring.alloy.gamma_max)
    finite = np.isfinite(gamma)
    noise = "" if gamma.ndim == 0 else " (near xi0 = 0 and 1 its noise is enough)"
    return _warnings({
        f"blind: the resistance of {name} lies outside what its phases allow at that strain{noise}, so the"
        " reading was held at 0 or 1": clipped & finite,
        f"blind: both phases of {name} conduct alike at that strain, so its resistance does not tell its"
        " martensite fraction": degenerate & ~clipped & finite,
        f"extrapolated: {name} is strained beyond gamma = {limit:g}, to which its resistivity is known"
        : finite & (gamma > limit),
        f"extrapolated: {name} is pushed shorter than its free length": finite & (gamma < 0.0),
    })  # fmt: skip


def _tested_range(law: SiliconeLaw) -> tuple[float, float] | None:
    """Range of strains that a law was fitted to; None where the law does not state it."""
    law = law.law if isinstance(law, Scaled) else law
    if isinstance(law, RegularisedSilicone):
        return float(law.lower), float(law.upper)
    if isinstance(law, PolynomialFit):
        return float(law.strain_min), float(law.strain_max)
    return None


def silicone_cautions(law: SiliconeLaw, least: np.ndarray, most: np.ndarray) -> list[str]:
    """Warnings where the silicone is strained beyond its tests.

    Args:
        law: law of the wall's silicone.
        least, most: smallest and largest strain of each state [1].
    """
    limits = _tested_range(law)
    if limits is None:
        return []
    low, high = limits
    least, most = np.asarray(least), np.asarray(most)
    return _warnings({
        f"extrapolated: the silicone is compressed beyond the strain {low:g} to which its law is fitted"
        : least < low,
        f"extrapolated: the silicone is stretched beyond the strain {high:g} to which it was tested"
        : most > high,
    })  # fmt: skip


def actuator_cautions(
    actuator: pj.Actuator,
    found: pj.Equilibrium,
    touching_deg: float = CLEARANCE_DEG,
    read: pj.Equilibrium | None = None,
) -> list[str]:
    """All warnings about an actuator's states.

    Args:
        actuator: actuator that was solved.
        found: equilibrium of one state or of rows.
        touching_deg: bend angle past which the tip may touch the base [deg], see `touching_angle`.
        read: equilibria at the resistances as measured, where `found` belongs to denoised ones.
    """
    sentences = _unsolved_sentences(statuses(found, read))
    source = found if read is None else read
    for number, spring, response, reading in zip(
        actuator.spring_numbers, actuator.springs, found.springs, source.springs, strict=True
    ):
        sentences += spring_cautions(spring, response, f"spring {number}", reading)
    bend = np.linalg.norm(np.asarray(found.bend), axis=-1)
    mean, swing = np.asarray(found.delta_centre), bend * float(actuator.section.radius)
    length = float(actuator.length)
    sentences += silicone_cautions(actuator.silicone, (mean - swing) / length, (mean + swing) / length)
    bend_deg = np.rad2deg(bend)
    return sentences + touching_cautions(bend_deg, bend_deg > touching_deg, touching_deg)


def models_contact(model: AugmentedModel) -> bool:
    """True if a model has the contact of tip and base among its effects."""
    return any(isinstance(added, AddedEffect) and added.slug == TipContact.slug for added in model.added)


def touching_angle(geometry: Mapping[str, Any], model: AugmentedModel | None = None) -> float:
    """Bend angle past which the tip may touch the base [deg]: `CLEARANCE_DEG` unless a specimen states it.

    Args:
        geometry: dimensions of the specimen as in its sidecar, of which `tip_to_base_clearance_deg` counts.
        model: model that is asked; the base model if None. Infinite where it has the contact.
    """
    if model is not None and models_contact(model):
        return float("inf")
    stated = geometry.get("tip_to_base_clearance_deg")
    return CLEARANCE_DEG if stated is None else float(stated)


def touching_cautions(
    bend: np.ndarray, touching: np.ndarray, limit: float | None = None, rows: str = "rows"
) -> list[str]:
    """Warning that a body may touch itself, with the largest angle and the number of rows; none elsewhere.

    Args:
        bend: bend angle of each row, of all segments in series together [deg].
        touching: true for rows in which the body may touch itself.
        limit: angle past which the tip may touch the base [deg], see `touching_angle`; None where parts
            overlap.
        rows: noun for what is counted.
    """
    bend, touching = np.asarray(bend), np.asarray(touching)
    if not np.any(touching):
        return []
    most, where = float(np.max(bend[touching])), _rows_text(touching).replace("rows", rows)
    if limit is None:
        return [f"bent by {_up_to(where)}{most:.0f} degrees in all{where}, where parts of the body overlap: "
                "contact is not modelled"]  # fmt: skip
    return [f"bent by {_up_to(where)}{most:.0f} degrees{where}: past {limit:g} degrees the tip may touch the "
            "base, and contact is not modelled"]  # fmt: skip


def chain_touching_cautions(shape: ChainShape, rows: str = "rows") -> list[str]:
    """Warning that parts of a chain overlap in some rows; see `touching_cautions`.

    Args:
        shape: of one chain, or of rows.
        rows: noun for what is counted.
    """
    bend = np.rad2deg(np.asarray(shape.total_bend))
    overlap = np.asarray(shape.clearance().smallest) < 0.0
    return touching_cautions(bend, overlap, rows=rows)


def _up_to(rows: str) -> str:
    return "up to " if rows else ""


def statuses(found: pj.Equilibrium, read: pj.Equilibrium | None = None) -> np.ndarray:
    """Status of every state. A solved row is marked where its measured resistances had several equilibria.

    Args:
        found: equilibrium of one state or of rows.
        read: equilibria at the resistances as measured, where `found` belongs to denoised ones.
    """
    status = np.asarray(found.status)
    if read is None or not status.ndim:
        return status
    several = np.asarray(read.status) == pj.Status.several_equilibria
    return np.where((status == pj.Status.converged) & several, pj.Status.several_equilibria, status)


def _unsolved_sentences(status: np.ndarray) -> list[str]:
    """Sentence with the number of rows without a solution, or with several, and the reason."""
    if status.ndim == 0:
        return []
    sentences = []
    for code in pj.Status:
        count = int(np.sum(status == code))
        if code == pj.Status.several_equilibria and count:
            sentences.append(
                f"{count} of {status.size} rows have several equilibria with these resistances:"
                " the one on the way of the history is given"
            )
        elif code != pj.Status.converged and count:
            sentences.append(f"{count} of {status.size} rows have no result: {code.sentence}")
    return sentences
