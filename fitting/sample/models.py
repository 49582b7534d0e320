"""The posterior of recordings that `fitting.specimens` can predict: springs, wires, tubes, actuators."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Recording, all_real, notices_of_reading, schema
from fitting.inference.notes import joined, of_several
from fitting.inference.parameters import Parameters
from fitting.specimens import Model, Rows, residual_of, specimen_of, stack
from fitting.specimens.correlated_noise import spread_of
from fitting.specimens.rows import held
from fitting.specimens.with_saved_model import Augmented
from pneusma_jax.units import from_si

from .order import exchangeable, keeps_order
from .problem import Curve, Problem
from .target import Target

NOISE = "Gaussian noise as the recordings state it or as it was estimated"
ORDERED = "{} keep the order of the fit: terms that change places are the same law."
HORIZONTAL = ("elongation", "pressure", "strain")
"""Candidate inputs for the horizontal axis, in order; time where a model has none that moves."""


def model_problem(
    title: str,
    recordings: Sequence[Recording],
    rows: Sequence[Rows],
    parameters: Parameters,
    notes: Sequence[str] = (),
    model: Model | None = None,
) -> Problem:
    """Posterior of recordings of one kind.

    The likelihood is that of the model's residual, whose weights carry noise and serial correlation. Latent
    trajectories are profiled. Recordings for validation are predicted only.

    Args:
        title: title of the campaign.
        recordings: recordings of one kind.
        rows: recordings as arrays, with the decisions of a fit.
        parameters: free parameters with priors, at the start values; SI, `unit` the one of files.
        notes: further sentences about noise and priors.
        model: model that predicts; that of the kind by default.
    """
    kind = recordings[0].kind
    model, everything = model or specimen_of(kind), stack(rows)
    used = np.array([k for k, recording in enumerate(recordings) if recording.role == "fit"], int)
    data = jax.tree.map(lambda leaf: np.asarray(leaf)[used], everything)  # of no others: each costs its time
    terms = [one for one in _alike(model) if exchangeable(parameters, one)]
    orders = [keeps_order(parameters, [term[0] for term in one]) for one in terms]
    searched = model.specimen.latent.inside  # for each point by itself
    target = Target.from_residual(residual_of(model), parameters, data, orders=orders, in_turn=searched)
    target = replace(target, sigmoid_law=model.specimen.sigmoid_law)
    told = notices_of_reading(recording.whole for recording in recordings)
    how = f"{NOISE}, larger where it is serially correlated."
    shown = [
        (k, quantity)
        for k, recording in enumerate(recordings)
        for quantity in model.outputs
        if np.any(np.asarray(rows[k].weight[quantity]) > 0.0)
    ]
    priors = [name for name, p in parameters.items() if p.prior is not None and p.free]
    notes = [*(ORDERED.format(joined([term[0] for term in one])) for one in terms), *notes]
    return Problem(
        title=title,
        kind=kind,
        real=all_real(recordings),
        target=target,
        parameters=parameters,
        predict=_predict(model, [(k, q, len(rows[k].mask), schema.column_of(kind, q)) for k, q in shown]),
        data=everything,
        curves=tuple(_curve(recordings[k], rows[k], quantity) for k, quantity in shown),
        notes=(how, f"Gaussian priors, cut at their bounds, on {', '.join(priors) or 'nothing'}.", *notes),
        notices=tuple(of_several(told, [recording.name for recording in recordings])),
    )


def _alike(model: Model) -> list[list[tuple[str, ...]]]:
    """Terms of a model that may change places; a base model has none."""
    return model.alike() if isinstance(model, Augmented) else []


def _predict(model: Model, shown: Sequence[tuple[int, str, int, str]]) -> Callable:
    """Predictions of the shown outputs one after the other, without padding, in the units of files."""

    def predict(values: Mapping[str, Array], stacked: Rows) -> Array:
        found = jax.vmap(lambda rows: model.predict(values, rows))(stacked)
        return jnp.concatenate([from_si(found[q][k, :count], _unit(column)) for k, q, count, column in shown])

    return predict


def _unit(column: str) -> str:
    return schema.quantity_and_unit(column)[1]


def _curve(recording: Recording, rows: Rows, quantity: str) -> Curve:
    column, weight = schema.column_of(recording.kind, quantity), np.asarray(rows.weight[quantity])
    counted = weight > 0.0
    over = next((name for name in HORIZONTAL if name in rows.inputs and not held(rows, name)), None)
    x_column = "time_s" if over is None else schema.column_of(recording.kind, over)
    x = np.asarray(rows.time if over is None else rows.inputs[over])
    measured = from_si(np.asarray(rows.measured[quantity]), _unit(column))
    sigma = from_si(1.0 / np.where(counted, weight, 1.0), _unit(column), difference=True)
    return Curve(
        recording=recording.name,
        role=recording.role,
        x_column=x_column,
        y_column=column,
        x=np.asarray(from_si(x, _unit(x_column))),
        measured=np.where(counted, measured, np.nan),
        sigma=np.where(counted, sigma * spread_of(rows, quantity), np.nan),
    )
