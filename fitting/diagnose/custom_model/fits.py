"""Fits of a custom model with some of its terms, scores of the others, and cross-validation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.least_squares import FitResult, fit_least_squares
from pneusma_jax.errors import InputError
from pneusma_jax.numerics.safe import as_arrays

from ..settings import DEFAULT
from .data import OwnRecording, stacked
from .model import OwnModel

OPTIMISER = DEFAULT.optimiser


@dataclass(frozen=True)
class OwnFit:
    """A model refitted with some terms.

    Attributes:
        present: terms.
        result: result of the least squares.
        chi_square: chi-square of the fitted recordings, priors left out.
        objective: half the sum of squares, priors included.
        at_bound: parameters of terms that ended on a physical bound.
    """

    present: tuple[str, ...]
    result: FitResult
    chi_square: float
    objective: float
    at_bound: tuple[str, ...]


class Problem:
    """An own model with its recordings: everything that is evaluated goes through here.

    Args:
        model: base and candidate terms.
        recordings: recordings, at least one to fit.

    Raises:
        InputError: if recordings do not agree, or a term acts at a slot that the base does not have.
    """

    def __init__(self, model: OwnModel, recordings: Sequence[OwnRecording]):
        self.model, self.recordings = model, list(recordings)
        self.data = stacked(self.recordings)
        self.fitted = np.array([float(r.role == "fit") for r in self.recordings])
        if not self.fitted.any():
            raise InputError("every recording has role validation; nothing is left to fit")
        first = self.recordings[0]
        model.check_slots(first.columns, first.facts)
        self._slopes = jax.jit(jax.jacfwd(self.residual))
        self._outputs = jax.jit(
            lambda values, tree: jax.vmap(lambda c, f: model.predict(values, c, f))(
                tree["columns"], tree["facts"]
            )
        )

    def residual(self, values: Mapping[str, Array], tree: Mapping[str, Mapping[str, Array]]) -> Array:
        """Misfit in standard deviations, (recordings * rows * ...,)."""
        found = jax.vmap(lambda c, f: self.model.predict(values, c, f))(tree["columns"], tree["facts"])
        parts = [tree["weight"][k] * (found[k] - tree["measured"][k]) for k in sorted(tree["weight"])]
        count = len(self.recordings)
        return jnp.concatenate([part.reshape(count, -1) for part in parts], axis=1).ravel()

    def fit(
        self,
        present: Sequence[str] = (),
        start: Mapping[str, float] | None = None,
        chosen: np.ndarray | None = None,
    ) -> OwnFit:
        """Refit base and terms together.

        Args:
            present: terms that may be there.
            start: values to start from; nominal ones, and typical terms, too, are always tried.
            chosen: weight of every recording; those of role `fit` by default.
        """
        chosen = self.fitted if chosen is None else chosen
        parameters = self.model.with_terms(present)
        typical = {}
        for name in present:
            term = self.model.term(name)
            typical |= {term.full(key): spec.typical for key, spec in term.specs.items()}
        starts = [typical] if typical else []
        if start is not None:
            starts.append({n: start[n] for n in parameters if n in start})
        result = fit_least_squares(
            self.residual, parameters, data=self.data.tree(chosen), use_priors=True, starts=starts or None,
            observations=self.data.counted(chosen), scale_covariance=False,
        )  # fmt: skip
        own = {full for name in present for full in self._full_names(name)}
        bound = tuple(n for n in result.parameters if n in own and result.parameters[n].at_bound)
        square = float(np.sum(result.residual**2))
        prior = float(np.sum(result.prior_residual**2))
        return OwnFit(tuple(present), result, square, 0.5 * (square + prior), bound)

    def _full_names(self, name: str) -> list[str]:
        term = self.model.term(name)
        return [term.full(key) for key in term.specs]

    def outputs(self, values: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Predictions of every recording, (recordings, rows, ...)."""
        return jax.device_get(self._outputs(as_arrays(values), self.data.tree(self.fitted)))

    def rmse(self, values: Mapping[str, float], chosen: np.ndarray) -> dict[str, float]:
        """Error of every output on some recordings, in its unit."""
        found, errors = self.outputs(values), {}
        for name, predicted in found.items():
            there = (self.data.weight[name] > 0.0) & (chosen > 0.0).reshape(-1, *[1] * (predicted.ndim - 1))
            errors[name] = float(np.sqrt(np.mean((predicted - self.data.measured[name])[there] ** 2)))
        return errors

    def misfit(self, values: Mapping[str, float], chosen: np.ndarray) -> np.ndarray:
        """Misfit of some recordings in standard deviations, (chosen, values)."""
        flat = np.asarray(self.residual(as_arrays(values), self.data.tree(chosen)))
        return flat.reshape(len(self.recordings), -1)[chosen > 0.0]

    def left_out(self, fit: OwnFit) -> float:
        """Chi-square per value of fitted recordings, each predicted by a fit without it."""
        total = 0.0
        for k in np.flatnonzero(self.fitted):
            alone = np.zeros(len(self.fitted))
            alone[k] = 1.0
            if self.fitted.sum() < 2:
                return fit.chi_square / self.data.counted(self.fitted)
            refit = self.fit(fit.present, fit.result.values, self.fitted - alone)
            total += float(np.sum(self.misfit(refit.result.values, alone) ** 2))
        return total / self.data.counted(self.fitted)

    def gains(self, fit: OwnFit) -> dict[str, float]:
        """Score of each absent term: the decrease of chi-square along its sensitivity, projected off the fit.

        Where the derivative at neutral vanishes (a threshold), the difference that a typical term makes
        stands in.
        """
        values = self.model.neutral() | fit.result.values
        tree = self.data.tree(self.fitted)
        slopes = jax.device_get(self._slopes(as_arrays(values), tree))
        r = np.asarray(self.residual(as_arrays(values), tree))
        free = [n for n in fit.result.parameters if fit.result.parameters[n].free]
        A = np.stack([slopes[name] for name in free], axis=1)
        basis = np.linalg.svd(A / np.maximum(np.linalg.norm(A, axis=0), 1e-300), full_matrices=False)[0]
        project = lambda x: x - basis @ (basis.T @ x)  # noqa: E731
        found = {}
        for term in (t for t in self.model.terms if t.name not in fit.present):
            J = np.stack([slopes[n] for n in term.amplitudes], axis=1)
            spans = [abs(s.typical - s.neutral) or s.high - s.low for s in term.specs.values() if not s.shape]
            J = project(J * np.array(spans))
            if np.linalg.norm(J) < OPTIMISER.rounding * np.linalg.norm(r):
                typical = values | {term.full(k): s.typical for k, s in term.specs.items()}
                J = project(np.asarray(self.residual(as_arrays(typical), tree)) - r)[:, None]
            Q, R = np.linalg.qr(J)
            Q = Q[:, np.abs(np.diag(R)) > OPTIMISER.rounding * max(np.linalg.norm(r), 1e-300)]
            found[term.name] = float(np.sum((Q.T @ r) ** 2))
        return found
