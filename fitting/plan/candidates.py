"""Candidate tests of a first campaign: strains, steps and phase of the loading."""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import numpy as np
from jaxtyping import Array

from fitting.calibrate.spring.reach import HOT_STEPS, STEPS

SHARES = tuple(k / 8.0 for k in range(1, 8))  # Held resistances, from the hot (0) to the cold one (1) at rest
HOT_SHARE = 0.45  # Share of the held resistance below which a spring may be fully heated at high strain
LEG_ROWS = 12  # Number of independent readings of a pull or a return
LATENT_ROWS = 4  # Number of readings that share one unknown deviation of the phase
COLD, HOT, HELD, HEATED = range(4)
HOLDS = ("cold", "hot", "resistance", "heated at length")
PHASE_SD = (0.003, 0.01, 0.3, 0.3)
"""Standard deviation of the martensite fraction by hold, before resistance is read."""


@dataclass(frozen=True)
class Candidate:
    """A candidate test.

    Attributes:
        hold: `COLD` (unheated), `HOT` (full current), `HELD` (resistance held by a controller) or `HEATED`
            (pulled cold, heated through and cooled at that length, released).
        strains: spring strains of the loading cycles, in order [1].
        share: position of the held resistance between the hot (0) and the cold one (1) at rest; 0 where none
            is held.
    """

    hold: int
    strains: tuple[float, ...]
    share: float = 0.0

    @property
    def is_hot(self) -> bool:
        """True if the spring is too hot to be stretched far."""
        return self.hold in (HOT, HEATED) or (self.hold == HELD and self.share < HOT_SHARE)

    @property
    def name(self) -> str:
        """Short name for tables and files, such as `held_0.50_to_575`."""
        head = {COLD: "cold", HOT: "hot", HELD: f"held_{self.share:.3g}", HEATED: "heated"}[self.hold]
        steps = "in_steps_" if len(self.strains) > 1 else ""
        twice = "_twice" if self.strains.count(self.strains[-1]) > 1 else ""
        return f"{head}_{steps}to_{100.0 * max(self.strains):.0f}{twice}"

    @property
    def words(self) -> str:
        """Description in words."""
        peaks = ", ".join(f"{100.0 * s:.0f}" for s in self.strains)
        pulls = f"pull to {peaks} % of the free length, back to 0 after each"
        if self.hold == HEATED:
            return f"pull cold to {peaks} %, heat through and let cool at that length, release"
        where = {COLD: "cold", HOT: "at full current", HELD: "with resistance held"}[self.hold]
        return f"{pulls}, {where}"


def candidates(steps: tuple[float, ...] = STEPS, shares: Sequence[float] = SHARES) -> list[Candidate]:
    """Candidate tests at every phase: single pulls to each step, stepwise ones, and these with the last step
    repeated.

    Args:
        steps: spring strains, ascending.
        shares: positions of held resistances between the hot (0) and the cold one (1) at rest.
    """
    tests = []
    for hold, share in [(COLD, 0.0), (HOT, 0.0), *((HELD, s) for s in shares)]:
        reach = steps[:HOT_STEPS] if Candidate(hold, steps[:1], share).is_hot else steps
        tests += [Candidate(hold, (peak,), share) for peak in reach]
        tests += [Candidate(hold, reach[: k + 1], share) for k in range(1, len(reach))]
        tests.append(Candidate(hold, (*reach, reach[-1]), share))
    return [*tests, *(Candidate(HEATED, (peak,)) for peak in steps[:HOT_STEPS])]


def published_campaign(steps: tuple[float, ...] = STEPS) -> list[Candidate]:
    """The source's seven tests of one spring: cold, hot, and five resistances between."""
    hot, full = steps[:HOT_STEPS], (*steps, steps[-1])
    shares = [k / 6.0 for k in range(1, 6)]
    return [
        Candidate(COLD, full),
        Candidate(HOT, hot),
        *(Candidate(HELD, hot if s < HOT_SHARE else full, s) for s in shares),
    ]


class Courses(eqx.Module):
    """Tests as arrays with masked padding.

    Attributes:
        strain: spring strain, shape (tests, rows).
        warmth: heating at constant length, from 0 cold to 1 hot, shape (tests, rows).
        mask: true in rows that count, shape (tests, rows).
        hold: code of `Candidate.hold`, shape (tests,).
        share: position of the held resistance, see `Candidate`, shape (tests,).
        phase_sd: standard deviation of the phase before the resistance is read, shape (tests,).
    """

    strain: Array
    warmth: Array
    mask: Array
    hold: Array
    share: Array
    phase_sd: Array


def courses(tests: Sequence[Candidate]) -> Courses:
    """Arrays of the tests, all of one length."""
    parts = [_course(test) for test in tests]
    size = -(-max(len(strain) for strain, _ in parts) // LATENT_ROWS) * LATENT_ROWS

    def padded(series: np.ndarray) -> np.ndarray:
        return np.pad(series, (0, size - len(series)))

    return Courses(
        strain=np.stack([padded(strain) for strain, _ in parts]),
        warmth=np.stack([padded(warmth) for _, warmth in parts]),
        mask=np.stack([padded(np.ones(len(strain))) for strain, _ in parts]),
        hold=np.array([test.hold for test in tests]),
        share=np.array([test.share for test in tests]),
        phase_sd=np.array([PHASE_SD[test.hold] for test in tests]),
    )


def _course(test: Candidate) -> tuple[np.ndarray, np.ndarray]:
    """Spring strain and warmth of one test, shape (rows,) each."""
    up = np.arange(1, LEG_ROWS + 1) / LEG_ROWS
    if test.hold == HEATED:
        peak, still = test.strains[0], np.ones(2 * LEG_ROWS)
        warm = np.arange(1, 2 * LEG_ROWS + 1) / (2 * LEG_ROWS)
        strain = np.concatenate([peak * up, peak * still, peak * still, peak * (1.0 - up)])
        return strain, np.concatenate([0.0 * up, warm, 1.0 - warm, 0.0 * up])
    strain = np.concatenate([np.concatenate([peak * up, peak * (1.0 - up)]) for peak in test.strains])
    return strain, np.zeros(len(strain))
