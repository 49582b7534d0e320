"""Refusal of recordings of which the model has no answer at all."""

from collections.abc import Sequence

import numpy as np

from fitting.data.recordings import Recording
from pneusma_jax.errors import InputError

from .evaluation import Evaluation


def refuse_no_answer(recordings: Sequence[Recording], fitted: np.ndarray, nominal: Evaluation) -> None:
    """Refuse recordings of which the model has no answer in any fitted row.

    Args:
        recordings: recordings of a campaign.
        fitted: true for those that are fitted, (recordings,).
        nominal: evaluation of the nominal base model.

    Raises:
        InputError: if there is no answer. It names the ranges of the inputs.
    """
    among = np.flatnonzero(fitted)
    if not among.size or any(np.isfinite(x).any() for k in among for x in nominal.predicted[k]):
        return
    first = recordings[among[0]]
    inputs = {n: values for n, values in first.columns.items() if n not in (*first.outputs, "time_s")}
    known = {name: values[np.isfinite(values)] for name, values in inputs.items()}
    spans = [f"{name} from {x.min():.4g} to {x.max():.4g}" for name, x in known.items() if x.size]
    raise InputError(
        f"{first.path or first.name}: the model has no answer in any row of the fitted recordings; are these "
        f"its inputs: {', '.join(spans)}?"
    )
