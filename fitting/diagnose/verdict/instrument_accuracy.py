"""Evidence that inaccurate instruments explain: static errors, and slow drift.

Where nobody states the noise, an instrument may err by up to `ACCURACY` of its range. A static error is a
smooth function of what an instrument reads, and its zero may differ between recordings. A drift is slow. Both
are Gaussian processes, linear in their numbers. So their evidence beside any fitted model is a closed form.
"""

import numpy as np
from scipy.linalg import block_diag

from fitting.inference.noise import ACCURACY

from ..evaluate.inputs import shifted
from ..evaluate.program import Program
from ..fit.evidence import evidence, inflation_of
from ..fit.instrument_drift import cosines, drift_columns
from ..fit.misfit import accurate, range_of
from ..fit.refit import Fit
from ..settings import DEFAULT
from .discrepancy_evidence import discrepancy_beside, linearised, smooth_factor
from .locate import hats_at, knots_of

DISCREPANCY = DEFAULT.discrepancy
EVIDENCE = DEFAULT.evidence


def beyond_accuracy(program: Program, base: Fit, named: Fit) -> float:
    """Log Bayes factor of effects over instruments of which one or all err, drift, or both; deflated.

    The errors of most evidence count, with the effects and without them. A static error is the same with
    them and without. So one that explains what the effects explain leaves these no evidence, however simple
    they are.

    Args:
        program: program of the campaign.
        base: model without the effects.
        named: model with them.
    """
    inflation = inflation_of(program, named)
    without, beside = (
        [error_gains(program, fit, errors) for errors in _errors(program, fit)] for fit in (base, named)
    )
    same = np.max(without[0] - beside[0], initial=0.0)
    least, most = (max(float(np.max(gains, initial=0.0)) for gains in each) for each in (beside, without))
    return evidence(program, base, named, inflation) - max(float(same), most - least) / inflation


def error_gains(program: Program, fit: Fit, errors: list[np.ndarray]) -> np.ndarray:
    """Log-evidence that errors of instruments add to a fitted model, its numbers following; not deflated.

    Returns:
        By what errs, and by sizes up to the accuracy of instruments, (errors, sizes).
    """
    misfit = fit.evaluation.misfit
    counts = np.concatenate([np.full(len(m), float(f)) for m, f in zip(misfit, program.fitted, strict=True)])
    nominal, A, *_ = linearised(program, fit, fit.evaluation)
    nominal, A = counts * nominal, counts[:, None] * A
    return np.array([_gains(nominal, A, counts[:, None] * D, _sizes()) for D in errors])


def excused(program: Program, fit: Fit) -> bool:
    """True if inaccurate instruments whose noise nobody states may be all that a base model misses."""
    if not accurate(program, fit):
        return False
    return nameless_beyond_accuracy(program, fit) <= EVIDENCE.minimum_settled


def nameless_beyond_accuracy(program: Program, fit: Fit) -> float:
    """Log Bayes factor of a discrepancy over instruments of which one or all err, drift, or both; deflated.

    Args:
        program: program of the campaign.
        fit: fit of the base model.
    """
    static, drifting = _errors(program, fit)
    sizes = (0.0, *_sizes())
    return discrepancy_beside(program, fit, [(D, sizes) for D in [*static, *drifting]])


def _errors(program: Program, fit: Fit) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Sensitivities to errors of one instrument or of all, as large as their accuracy, (values, errors) each.

    An output errs statically over any of the distances of a discrepancy. An input has an error of zero, of
    gain and of linearity.

    Returns:
        Static errors. Then drifts, alone and beside static errors of all.
    """
    measured = dict.fromkeys(c.quantity for k in np.flatnonzero(program.fitted) for c in program.channels[k])
    outputs = [_errors_of_output(program, fit, name) for name in measured]
    inputs = _errors_of_inputs(program, fit)
    together = [np.concatenate([*some, *inputs], axis=1) for some in zip(*outputs, strict=True)]
    drift = drift_columns(program, fit.evaluation, lambda name: ACCURACY * range_of(program, name))
    drifts = [drift, *_errors_of_inputs(program, fit, drifting=True)]
    whole = np.concatenate(drifts, axis=1)
    both = [np.concatenate([D, whole], axis=1) for D in together]
    return [*(D for some in outputs for D in some), *inputs, *together], [*drifts, whole, *both]


def _sizes() -> np.ndarray:
    """Sizes of errors, as parts of the accuracy of instruments."""
    return np.array(DISCREPANCY.sizes) / DISCREPANCY.sizes[-1]


def _gains(nominal: np.ndarray, A: np.ndarray, D: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Log-evidence of errors beside a model, (sizes,).

    Args:
        nominal: misfit with every number of the model at the mean of its prior, (values,).
        A: its derivatives by these numbers, whose priors are of unit size, (values, numbers).
        D: its derivatives by errors of unit variance, (values, errors).
        sizes: standard deviations of the errors.
    """
    G = np.linalg.inv(np.eye(A.shape[1]) + A.T @ A)
    across = D.T @ A
    known, axes = np.linalg.eigh(D.T @ D - across @ G @ across.T)
    seen = (axes.T @ (D.T @ nominal - across @ G @ (A.T @ nominal))) ** 2
    variances = np.square(sizes)[:, None]
    ratio = variances * np.maximum(known, 0.0)
    return 0.5 * np.sum(variances * seen / (1.0 + ratio) - np.log1p(ratio), axis=1)


def _errors_of_output(program: Program, fit: Fit, quantity: str) -> list[np.ndarray]:
    """Sensitivities of the misfit to static errors of an output, for every distance, (values, errors).

    They are as large as its accuracy: a smooth function of what the model predicts, and a zero of each
    recording.
    """
    predicted, followed = fit.evaluation.predicted, program.followed(fit.evaluation)
    read = [
        values[np.isfinite(channel.sigma) & np.isfinite(values)]
        for k in np.flatnonzero(program.fitted)
        for channel, values in zip(program.channels[k], predicted[k], strict=True)
        if channel.quantity == quantity
    ]
    values_read = np.concatenate([np.zeros(0), *read])
    knots = knots_of(values_read, DISCREPANCY.knots) if values_read.size else None
    size, bent, zeros = ACCURACY * range_of(program, quantity), [], []
    for k, channels in enumerate(program.channels):
        parts = []
        for channel, values in zip(channels, predicted[k], strict=True):
            there = np.isfinite(channel.sigma) & (channel.quantity == quantity)
            one = np.where(there, size, 0.0)[None]
            if knots is not None:
                one = np.concatenate([one, one * hats_at(np.nan_to_num(values), knots)])
            parts.append(channel.whitened(one))
        added = np.concatenate(parts, axis=1)
        added = followed[k].projected(added)[0] if followed[k] else added
        zeros.append(added[:1].T)
        bent.append(added[1:].T)
    smooth, own = np.concatenate(bent), block_diag(*zeros)
    return [
        np.concatenate([own, smooth @ smooth_factor(smooth.shape[1], length)], axis=1)
        for length in DISCREPANCY.lengths
    ]


def _errors_of_inputs(program: Program, fit: Fit, drifting: bool = False) -> list[np.ndarray]:
    """Sensitivities of the misfit to errors of every measured input, (values, errors) of each.

    They are as large as its accuracy: a zero of each recording, an error of gain and one of linearity. An
    input that drifts has slow cosines of each recording instead.
    """
    still = program.begun(program.stacked, fit.evaluation, fit.u)
    nothing, followed = program.unknowns.base[:0], program.followed(fit.evaluation)
    there, found = program.evaluate(fit.u, nothing, still).misfit, []

    def moved(name: str, by: np.ndarray) -> list[np.ndarray]:
        """Change of the misfit of every recording, (values,), when an input is shifted in every row."""
        other = program.evaluate(fit.u, nothing, shifted(still, name, by)).misfit
        changes = [np.nan_to_num(b - a)[None] for a, b in zip(there, other, strict=True)]
        return [(p.projected(c)[0] if p else c)[0] for p, c in zip(followed, changes, strict=True)]

    def of_each_recording(changes: list[np.ndarray]) -> np.ndarray:
        return block_diag(*(one[:, None] for one in changes))

    mask = np.asarray(program.stacked.mask).astype(bool)
    slow = np.stack([cosines(one) for one in mask], axis=1)
    for name in sorted(still.inputs.keys() - still.measured.keys()):
        values = np.nan_to_num(np.asarray(still.inputs[name]))
        low, high = np.min(values[mask]), np.max(values[mask])
        if high > low:
            place, size = 2.0 * (values - low) / (high - low) - 1.0, ACCURACY * (high - low)
            shapes = slow if drifting else [place**power for power in range(3)]
            zero, *others = [moved(name, size * shape) for shape in shapes]
            each = of_each_recording if drifting else lambda one: np.concatenate(one)[:, None]
            found.append(np.concatenate([of_each_recording(zero), *(each(one) for one in others)], axis=1))
    return found
