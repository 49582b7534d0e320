"""A campaign as one compiled program: every base constant and every candidate effect, neutral where it is
absent.

One evaluation gives the outputs of all recordings and their derivatives along a few directions. Everything
else in a diagnosis is linear algebra on its whitened results.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.augmented import AugmentedModel
from fitting.kept import kept
from fitting.models.rows import Rows, stack, with_numbers
from fitting.recordings import Campaign, Recording
from pneusma_jax.chain import Effect
from pneusma_jax.errors import InputError

from .inputs import input_noise, shifted, with_input_noise
from .kinds import LETTERS, Kind, candidates, kind_module
from .noise import Channel, channels_of
from .thin import thinned
from .unknowns import Unknowns

MOST_ROWS = 1024
"""Rows of a recording; longer ones are averaged over blocks."""
FAILED = 30.0
"""Standard deviations that a row counts for at least in which the model has no answer."""
WIDTH = 16
"""Directions of one evaluation."""


@dataclass
class Program:
    """A campaign that can be evaluated anywhere.

    Attributes:
        kind: of the recordings.
        recordings: those of the campaign, in its order.
        stacked: the same as arrays.
        channels: measured outputs by recording.
        unknowns: numbers that may be free.
        fitted: recordings whose role is `fit`, shape (recordings,).
        rows: recordings as arrays, one by one.
        evaluations: how often the program ran.
        failed: standard deviations that a row without an answer counts for; more than any misfit of the
            nominal base model, so that no fit gains by failing.
        taken: measured values of every recording that a hidden course takes up, shape (recordings,).
        bare: channels with their own noise only.
    """

    kind: str
    recordings: list[Recording]
    stacked: Rows
    channels: list[list[Channel]]
    unknowns: Unknowns
    fitted: np.ndarray
    rows: list[Rows]
    evaluations: int = field(default=0)
    failed: float = FAILED
    taken: np.ndarray = field(default_factory=lambda: np.zeros(0))
    bare: list[list[Channel]] = field(default_factory=list)
    _evaluate: Callable | None = field(default=None, repr=False)
    _always: tuple[Effect, ...] = ()

    @classmethod
    def of(
        cls,
        campaign: Campaign,
        kind: str,
        slugs: list[str] | None = None,
        model: AugmentedModel | None = None,
    ) -> "Program":
        """Build a program.

        Args:
            campaign: recordings of one kind.
            kind: that kind.
            slugs: effects to try; all of the kind if None.
            model: base model to start from: its numbers are nominal, its effects are always there.

        Raises:
            InputError: if the recordings cannot be used together.
        """
        module = kind_module(kind)
        rows = module.rows_for(thinned(campaign, getattr(module, "MOST_ROWS", MOST_ROWS)))
        model = model or AugmentedModel()
        there = tuple(added.slug for added in model.added)
        tried = [slug for slug in (candidates(kind) if slugs is None else slugs) if slug not in there]
        known = {name: q for table in model.base.values() for name, q in table.items()}
        rows = [with_numbers(r, known) for r in rows]
        stacked = stack(rows, coarse=True)
        unknowns = Unknowns(module.parameters_for(campaign), tried, LETTERS[kind], known)
        size = stacked.mask.shape[1]
        channels = [
            channels_of(recording, r, module.OUTPUTS, size)
            for recording, r in zip(campaign.recordings, rows, strict=True)
        ]
        for recording, found in zip(campaign.recordings, channels, strict=True):
            if not any(channel.count for channel in found):
                wanted = " or ".join(module.OUTPUTS)
                raise InputError(
                    f"{recording.path or recording.name}: there is no {wanted} to compare the model with"
                )
        fitted = np.array([recording.role == "fit" for recording in campaign.recordings])
        if not fitted.any():
            raise InputError(f"{campaign.path}: every recording has role validation; nothing is left to fit")
        program = cls(kind, list(campaign.recordings), stacked, channels, unknowns, fitted, rows)
        program.taken, program.bare = np.zeros(len(channels)), channels
        program._compile(module, model.effects)
        program.prepare(unknowns.neutral)
        program.settle(unknowns.neutral)
        program.count_input_noise(unknowns.neutral)
        program.prepare(unknowns.neutral)
        nominal = program.evaluate(unknowns.neutral, unknowns.base[:0]).misfit
        program.failed = max(FAILED, *(float(np.max(np.abs(m), initial=0.0)) for m in nominal))
        return program

    @property
    def unseen(self) -> np.ndarray:
        """Mask of the recordings that only score: those that are not fitted, or all where every one is."""
        return self.fitted if self.fitted.all() else ~self.fitted

    @property
    def has_walks(self) -> bool:
        """Whether the kind has hidden courses whose walks `prepare` finds."""
        return hasattr(kind_module(self.kind), "prepared")

    def prepare(self, u: np.ndarray) -> None:
        """Find the walks of hidden courses at the base constants of `u`, where the kind has them."""
        if self.has_walks:
            values = self.unknowns.values(u)
            self.stacked = kind_module(self.kind).prepared(values, self.stacked, self.channels)
            taken = self.evaluate(u, self.unknowns.base[:0]).drivers["taken"]
            self.taken = np.array([np.sum(taken[k]) for k in range(len(self.channels))])

    @property
    def has_phases(self) -> bool:
        """Whether the kind has hidden phases, which `settle` reads anew."""
        return hasattr(kind_module(self.kind), "settled")

    def settle(self, u: np.ndarray) -> None:
        """Read hidden phases anew at the strains of the model at `u`, where the kind has them."""
        if not self.has_phases:
            return

        def drivers(rows: list[Rows]) -> dict[str, np.ndarray]:
            return self.evaluate(u, self.unknowns.base[:0], stack(rows, self.stacked)).drivers

        self.rows = kind_module(self.kind).settled(self.rows, drivers)
        self.stacked = stack(self.rows, self.stacked)

    def count_input_noise(self, u: np.ndarray) -> None:
        """Add what the noise of measured inputs does to the outputs, as the model at `u` has it."""
        module, nothing = kind_module(self.kind), self.unknowns.base[:0]
        changes = {}
        if hasattr(module, "phase_changes"):

            def evaluate(rows: list[Rows]) -> "Evaluation":
                return self.evaluate(u, nothing, stack(rows, self.stacked))

            changes = {name: [one] for name, one in module.phase_changes(self.rows, evaluate).items()}
        noise = input_noise(self.recordings, self.stacked)
        noise = {name: sigma for name, sigma in noise.items() if name not in changes}
        here = self.evaluate(u, nothing).predicted if noise else []
        for name, sigma in noise.items():
            there = [
                self.evaluate(u, nothing, shifted(self.stacked, name, sign * sigma)).predicted
                for sign in (1.0, -1.0)
            ]
            changes[name] = [
                [[b - a for a, b in zip(x, y, strict=True)] for x, y in zip(here, one, strict=True)]
                for one in there
            ]
        self.channels = with_input_noise(self.bare, changes)

    def _compile(self, module: Kind, always: tuple[Effect, ...]) -> None:
        """One program for every campaign of these shapes: what a campaign states are arguments."""
        unknowns, count = self.unknowns, len(self.unknowns.base)

        def outputs(base: dict, own: jax.Array, always: tuple, stacked: Rows) -> tuple:
            rows = eqx.tree_at(lambda r: r.base, stacked, base)
            effects = (*always, *unknowns.effects(jnp.concatenate([jnp.zeros(count), own])))
            return jax.vmap(lambda row: module.predict({}, effects, row))(rows)

        def evaluate(
            base: dict, own: jax.Array, along_base: dict, along_own: jax.Array, always: tuple, stacked: Rows
        ) -> tuple:
            def along(base_step: dict, own_step: jax.Array) -> tuple:
                lead = lambda base, own: outputs(base, own, always, stacked)  # noqa: E731
                return jax.jvp(lead, (base, own), (base_step, own_step), has_aux=True)

            return jax.vmap(along, out_axes=(None, 0, None))(along_base, along_own)

        self._always = always
        self._evaluate = kept(evaluate, f"diagnosis of {self.kind}: {' '.join(unknowns.slugs)}")

    def evaluate(self, u: np.ndarray, columns: np.ndarray, stacked: Rows | None = None) -> "Evaluation":
        """Whitened misfit of every recording, and its derivative by some of the unknowns.

        Args:
            u: scaled numbers, shape (unknowns,).
            columns: indices of unknowns, any number.
            stacked: recordings of the same shape instead of the campaign's.
        """
        stacked = self.stacked if stacked is None else stacked
        columns = np.asarray(columns, int)
        unknowns = self.unknowns
        u = np.asarray(u, float)
        base = unknowns.stated(u, stacked)
        found, parts, drivers = None, [], None
        for first in range(0, max(len(columns), 1), WIDTH):
            chunk = columns[first : first + WIDTH]
            along_own = np.zeros((WIDTH, len(unknowns) - len(unknowns.base)))
            along_base = {name: np.zeros((WIDTH, *value.shape)) for name, value in base.items()}
            for row, k in enumerate(chunk):
                if k < len(unknowns.base):
                    stem, share = unknowns.slope(u, k, stacked)
                    along_base[stem][row] = share
                else:
                    along_own[row, k - len(unknowns.base)] = 1.0
            found, slopes, drivers = jax.device_get(
                self._evaluate(base, u[len(unknowns.base) :], along_base, along_own, self._always, stacked)
            )
            self.evaluations += 1
            parts.append({name: value[: len(chunk)] for name, value in slopes.items()})
        slopes = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        return self._whitened(found, slopes, drivers)

    def _whitened(self, found: dict, slopes: dict, drivers: dict) -> "Evaluation":
        misfit, jacobian, raw = [], [], []
        for k, channels in enumerate(self.channels):
            pieces, derivatives, plain = [], [], []
            for channel in channels:
                predicted, slope = found[channel.quantity][k], slopes[channel.quantity][:, k]
                good = np.isfinite(predicted) & np.all(np.isfinite(slope), axis=0)
                miss = np.where(good, predicted - channel.measured, self.failed * channel.sigma)
                miss = np.where(np.isfinite(channel.sigma), miss, 0.0)
                plain.append(np.where(good, predicted, np.nan))
                pieces.append(channel.whitened(miss))
                derivatives.append(channel.whitened(np.where(good, slope, 0.0)))
            misfit.append(np.concatenate(pieces))
            jacobian.append(np.concatenate(derivatives, axis=1))
            raw.append(plain)
        return Evaluation(misfit, jacobian, raw, drivers)

    def observations(self, chosen: np.ndarray) -> int:
        """Measured values of some recordings, given by a mask, less those that hidden courses take up."""
        return round(sum(self.count(k) * self.free_share(k) for k in np.flatnonzero(chosen)))

    def count(self, k: int) -> int:
        """Measured values of recording k."""
        return sum(channel.count for channel in self.channels[k])

    def free_share(self, k: int) -> float:
        """Part of the measured values of recording k that no hidden course takes up."""
        return 1.0 - float(self.taken[k]) / max(self.count(k), 1)


@dataclass(frozen=True)
class Evaluation:
    """Results of one evaluation.

    Attributes:
        misfit: whitened model minus data of each recording, all its channels in a row, (values,).
        jacobian: its derivative by each scaled unknown that was asked for, (columns, values).
        predicted: of each recording and channel, SI, (rows,), NaN where the model has no answer.
        drivers: what drives the outputs, by name, (recordings, rows).
    """

    misfit: list[np.ndarray]
    jacobian: list[np.ndarray]
    predicted: list[list[np.ndarray]]
    drivers: dict[str, np.ndarray]

    def joined(self, weight: np.ndarray | list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Misfit and Jacobian (values, columns) of recordings, each weighed by a number or a mask."""
        r = np.concatenate([w * m for w, m in zip(weight, self.misfit, strict=True)])
        J = np.concatenate([w * j for w, j in zip(weight, self.jacobian, strict=True)], axis=1)
        return r, J.T

    def chi2(self, weight: np.ndarray) -> float:
        """Sum of squares of the weighed misfit."""
        return float(sum(np.sum((w * m) ** 2) for w, m in zip(weight, self.misfit, strict=True)))
