"""Settings of sampling: all choices that change the chains, and the budget that ends them."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import emcee

from pneusma_jax.errors import InputError, nearest

from .independent import Proposals

FEWEST_WALKERS = 32  # Default number of walkers for few parameters
SAMPLERS = ("auto", "emcee", "nuts", "tempered")
"""See `Settings.sampler`."""


@dataclass(frozen=True)
class Settings:
    """Settings of a run.

    Attributes:
        sampler: "emcee" (ensembles around the fit), "nuts" (chains that follow gradients), "tempered"
            (ensembles of emcee that start from the prior), or "auto". With "auto" a short pilot run chooses
            "emcee" or "nuts".
        walkers: number of walkers of each ensemble of emcee, even; None for the larger of 32 and four times
            the number of parameters.
        ensembles: number of independent ensembles, for R-hat.
        max_steps: maximum number of steps of each ensemble; a run that has not converged by then says so.
        seed: seed of everything random.
        chunk: number of steps between two checkpoints; a run that is killed loses no more.
        warm_up: number of adaptation steps of a chain that follows gradients; they are discarded.
    """

    walkers: int | None = None
    ensembles: int = 4
    max_steps: int = 20000
    seed: int = 0
    chunk: int = 100
    sampler: str = "auto"
    warm_up: int = 400

    def resolved(self, dimension: int) -> "Settings":
        """Settings with the number of walkers decided.

        Raises:
            InputError: if a number cannot be used for this many parameters.
        """
        if self.sampler not in SAMPLERS:
            raise InputError(f"there is no sampler {self.sampler!r}, {nearest(self.sampler, SAMPLERS)}")
        walkers = max(FEWEST_WALKERS, 4 * dimension) if self.walkers is None else self.walkers
        if walkers % 2 or walkers < max(2 * dimension, 4):
            raise InputError(
                f"walkers = {walkers} must be even and at least {max(2 * dimension, 4)}, "
                f"twice the {dimension} free parameters"
            )
        for name, least in (("ensembles", 2), ("max_steps", 10), ("chunk", 1), ("seed", 0), ("warm_up", 50)):
            if getattr(self, name) < least:
                raise InputError(f"{name.replace('_', '-')} = {getattr(self, name)} must be at least {least}")
        return dataclasses.replace(self, walkers=walkers)

    def requested(self) -> dict[str, Any]:
        """`chain_identity` before a pilot has chosen the sampler; None where nothing was requested."""
        return {**self.chain_identity(), "sampler": None if self.sampler == "auto" else self.sampler}

    def chain_identity(self) -> dict[str, Any]:
        """Settings that must be equal for a chain to be continued; the budget may change."""
        own = {"warm_up": self.warm_up} if self.sampler == "nuts" else {"walkers": self.walkers}
        return {
            "sampler": self.sampler,
            **own,
            "ensembles": self.ensembles,
            "seed": self.seed,
            "chunk": self.chunk,
        }


def moves(proposals: Proposals | None = None) -> list[tuple[emcee.moves.Move, float]]:
    """Moves of walkers and their probabilities.

    Steps are draws about the fit as often as their share says. Of all others eight in ten are differential
    evolution. It decorrelates about three times faster than stretches. One in ten has `gamma0 = 1`, a whole
    difference of two walkers. It lets them change between modes (C. ter Braak, Statistics and Computing 16
    (2006) 239). One in ten is a stretch, which no pattern of differences can trap.

    Args:
        proposals: draws about the fit; None for none.
    """
    share = 0.0 if proposals is None else float(proposals.share)
    steps = [
        (emcee.moves.DEMove(), 0.8 * (1.0 - share)),
        (emcee.moves.DEMove(gamma0=1.0), 0.1 * (1.0 - share)),
        (emcee.moves.StretchMove(), 0.1 * (1.0 - share)),
    ]
    return steps if share == 0.0 else [*steps, (proposals.move, share)]
