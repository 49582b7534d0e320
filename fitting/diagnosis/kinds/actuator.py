"""Actuators in a diagnosis: pressure and measured resistances in, curvature, bend angle and length out."""

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.models import actuator
from fitting.models.actuator_phase import UNKNOWN
from fitting.models.actuator_rows import body_of
from fitting.models.rows import Rows, numbers
from fitting.recordings import Campaign, Recording
from fitting.simulation.denoise import smooth_walk
from pneusma_jax.chain import PLAIN, Chain, Effect
from pneusma_jax.loads import gravity_vector
from pneusma_jax.nitinol import Alloy, MartensiteFraction, SpringState
from pneusma_jax.nitinol.resistivity import PhaseReading
from pneusma_jax.tracking import track_history

OUTPUTS = ("curvature", "bend_angle", "length")
MOST_ROWS = 128
"""Rows of a recording: every one is an equilibrium."""
ROUNDS = 3
"""Rounds of smoothing from phases that were read under a similar model."""
NUDGE = 0.02
"""Change of a fraction by which the resistance's slope over it is taken."""
LONGEST = 0.1
"""Longest step of a fraction in one round; near full heat the tangent would throw it anywhere."""
FOLD = 0.08
"""Slope of the whole answer over that at a fixed strain below which a resistance is not followed: two
configurations of one resistance meet there."""
BLIND = 0.05
"""1-sigma of a fraction from which its resistance is not followed."""
FLATTEST = 1e-6
"""Of a wire's resistance: least slope over the fraction, relative."""
parameters_for = actuator.parameters_for


def rows_for(campaign: Campaign, **options: Any) -> list[Rows]:
    """Every recording as arrays, with what only effects ask for: currents, air temperature, gravity.

    Args:
        campaign: recordings of kind actuator, of one design.
        **options: of the base model's `rows_for`.
    """
    members = campaign.recordings
    shared = [
        q for q in ("current_1", "current_2", "current_3", "temperature") if any(r.has(q) for r in members)
    ]
    return [
        eqx.tree_at(lambda x: x.extra, rows, rows.extra | _recorded(recording, rows, shared))
        for recording, rows in zip(members, actuator.rows_for(campaign, **options), strict=True)
    ]


def _recorded(recording: Recording, rows: Rows, names: list[str]) -> dict[str, np.ndarray]:
    springs = len(rows.extra["xi0"])
    found = {"gamma": tuple(np.zeros(len(rows.mask)) for _ in range(springs))}
    found |= {
        "gravity": np.asarray(
            gravity_vector(recording.full_geometry().get("orientation", "vertical_base_down"))
        )
    }
    for name in names:
        nominal = 22.0 if name == "temperature" else 0.0
        column = np.full(len(rows.mask), nominal)
        if recording.has(name):
            values, time = recording.si(name), recording.si("time")
            held = np.isfinite(values) & np.isfinite(time)
            if held.any():
                column = np.interp(np.asarray(rows.time), time[held], values[held])
        found[f"recorded_{name}"] = column
    return found


class FollowedPhase(eqx.Module):
    """A martensite fraction known from a smoothed resistance, that follows sensors, resistivities and
    strain as far as the resistance tells it: not at all where a hot wire's resistance is blind to it.

    Strain moves the reading only in the last step of a row: iterated, strain and fraction would chase
    each other to another configuration of the same resistance. `settled` starts that step near its end.

    Attributes:
        xi0: smoothed fraction [1]; ohms: its resistance [ohm]; gain: fraction per resistance [1/ohm].
        gamma: strain at which it was read [1].
        strained: whether strain moves the reading.
    """

    xi0: Array
    ohms: Array
    gain: Array
    gamma: Array
    strained: bool = eqx.field(static=True, default=True)

    def held(self) -> "FollowedPhase":
        """The same at the strain at which it was read."""
        return FollowedPhase(self.xi0, self.ohms, self.gain, self.gamma, False)

    def read(self, alloy: Alloy, gamma: Array, wire_length: Array, chain: Chain = PLAIN) -> PhaseReading:
        """Fraction by one step from the smoothed one."""
        wire = chain.through("wire_resistance", self.ohms)
        at = gamma if self.strained else self.gamma
        surplus = wire - alloy.resistivity(self.xi0, at) * wire_length
        no = jnp.zeros((), bool)
        return PhaseReading(jnp.clip(self.xi0 + self.gain * surplus, 0.0, 1.0), no, no)


def settled(recordings: list[Rows], evaluate: Callable[[list[Rows]], dict[str, np.ndarray]]) -> list[Rows]:
    """Recordings whose phases are read anew under a model: smoothed about its whole answer, as
    `actuator_phase`.

    Args:
        recordings: before.
        evaluate: drivers of the model for recordings, by name, shape (recordings, rows).
    """
    layout = recordings[0].extra["layout"]
    wired = [(k, n) for k, n in enumerate(layout.spring_numbers) if f"resistance_{n}" in recordings[0].inputs]
    if not wired:
        return recordings
    slopes: dict[int, np.ndarray] = {}
    held = [_put(rows, gain=tuple(0.0 * np.asarray(g) for g in rows.extra["gain"])) for rows in recordings]
    for _ in range(ROUNDS):
        here = evaluate(held)
        for k, n in wired:
            there = evaluate([_moved(rows, k) for rows in held])
            slope = (there[f"ohms_{n}"] - here[f"ohms_{n}"]) / (there[f"xi0_{n}"] - here[f"xi0_{n}"])
            held = [_read(rows, k, n, here[f"ohms_{n}"][j], slope[j]) for j, rows in enumerate(held)]
            slopes[k] = slope
    here = evaluate(held)
    found = []
    for j, rows in enumerate(held):
        count = len(rows.mask)
        told = {
            name: tuple(np.nan_to_num(here[f"{name}_{n}"][j, :count]) for n in layout.spring_numbers)
            for name in ("ohms", "gamma")
        }
        gain = [np.zeros(count) for _ in layout.spring_numbers]
        for k, n in wired:
            gain[k] = _gain(rows, k, n, told["gamma"][k], np.nan_to_num(slopes[k][j, :count]))
        found.append(_put(rows, gain=tuple(gain), **told))
    return found


def phase_changes(
    recordings: list[Rows], evaluate: Callable[[list[Rows]], Any]
) -> dict[str, list[list[np.ndarray]]]:
    """What the outputs change when a fraction is off by as much as its resistance leaves open, by resistance.

    Where the whole answer folds, so that a colder spring is as much longer as to have the same resistance, or
    where a hot wire is blind, that is much, and the same along the recording.

    Args:
        recordings: as they were settled.
        evaluate: predictions and drivers of a model for recordings, an `Evaluation`.

    Returns:
        By name of the resistance: by recording and channel, (rows,).
    """
    layout = recordings[0].extra["layout"]
    held = [_put(rows, gain=tuple(0.0 * np.asarray(g) for g in rows.extra["gain"])) for rows in recordings]
    here, found = evaluate(held), {}
    for k, n in enumerate(layout.spring_numbers):
        name = f"resistance_{n}"
        if name not in recordings[0].inputs:
            continue
        there = evaluate([_moved(rows, k) for rows in held])
        found[name] = []
        for j, rows in enumerate(recordings):
            moved = {key: there.drivers[key][j] - here.drivers[key][j] for key in (f"ohms_{n}", f"xi0_{n}")}
            step = np.where(moved[f"xi0_{n}"] == 0.0, NUDGE, moved[f"xi0_{n}"])
            noise = float(rows.extra[f"noise_{name}"])
            told = np.nan_to_num(moved[f"ohms_{n}"] / step)
            sd = noise / np.sqrt(told**2 + (noise / UNKNOWN) ** 2) if noise > 0.0 else np.zeros(len(step))
            blind = sd > BLIND
            blind[len(rows.mask) :] = False
            sd = sd * np.sqrt(np.where(blind, max(blind.sum(), 1), 1.0))
            pairs = zip(here.predicted[j], there.predicted[j], strict=True)
            found[name].append([sd * (b - a) / step for a, b in pairs])
    return found


def _gain(rows: Rows, k: int, number: int, gamma: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Fraction per resistance at a fixed strain, less where noise or a fold of the whole answer blinds it."""
    noise = float(rows.extra[f"noise_resistance_{number}"])
    if not noise > 0.0:
        return np.zeros(len(gamma))
    spring = body_of(numbers({}, rows), rows).springs[k]
    law = lambda x: spring.alloy.resistivity(x, jnp.asarray(gamma)) * spring.geometry.wire_length  # noqa: E731
    xi0 = jnp.asarray(rows.extra["xi0"][k])
    partial = np.asarray(jax.jvp(law, (xi0,), (jnp.ones_like(xi0),))[1])
    square = np.where(total * partial > 0.0, total**2, 0.0)
    trust = square / (square + (FOLD * partial) ** 2 + (noise / BLIND) ** 2)
    return trust / np.where(partial == 0.0, np.inf, partial)


def _put(rows: Rows, **columns: tuple[np.ndarray, ...]) -> Rows:
    return eqx.tree_at(lambda r: r.extra, rows, rows.extra | columns)


def _moved(rows: Rows, k: int) -> Rows:
    """The recording with the fraction of spring k a little different."""
    xi0 = [np.asarray(x) for x in rows.extra["xi0"]]
    xi0[k] = xi0[k] + np.where(xi0[k] > 0.5, -NUDGE, NUDGE)
    return _put(rows, xi0=tuple(xi0))


def _read(rows: Rows, k: int, number: int, ohms: np.ndarray, slope: np.ndarray) -> Rows:
    """One round of smoothing of spring k's fraction; rows without an equilibrium keep theirs."""
    if not float(rows.extra[f"noise_resistance_{number}"]) > 0.0:
        return rows
    count = len(rows.mask)
    before, read = np.asarray(rows.extra["xi0"][k]), np.asarray(rows.inputs[f"resistance_{number}"])
    least = FLATTEST * float(np.median(read))
    slope = np.nan_to_num(slope[:count])
    slope = np.where(np.abs(slope) < least, least, slope)
    step = np.clip(np.nan_to_num((read - ohms[:count]) / slope), -LONGEST, LONGEST)
    after = np.clip(smooth_walk(np.asarray(rows.time), before + step, slope**2), 0.0, 1.0)
    return _put(rows, xi0=tuple(after if j == k else x for j, x in enumerate(rows.extra["xi0"])))


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `kinds.Kind`."""
    known = numbers(values, rows)
    body = body_of(known, rows)
    extra = rows.extra
    phases = tuple(
        FollowedPhase(*one)
        for one in zip(extra["xi0"], extra["ohms"], extra["gain"], extra["gamma"], strict=True)
    )
    one = jnp.ones(())
    states = tuple(SpringState(known["prestrain"], one) for _ in body.springs)
    pressure = rows.inputs["pressure"]
    known_rows = {"gravity": jnp.broadcast_to(extra["gravity"], (pressure.size, 3))}
    currents = {
        n: extra[f"recorded_current_{n}"] for n in body.spring_numbers if f"recorded_current_{n}" in extra
    }
    if currents:
        known_rows["currents"] = currents
    if "recorded_temperature" in extra:
        known_rows["temperature"] = extra["recorded_temperature"]
    guess = tuple(MartensiteFraction(x[0]) for x in extra["xi0"])
    track = track_history(body, pressure, phases, states, rows.time, effects, known_rows, guess)
    rate = jnp.gradient(pressure) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
    drivers = {"pressure": pressure, "pressure_rate": rate, "curvature": track.rows.curvature}
    drivers |= {f"current_{n}": values for n, values in currents.items()}
    for number, response in zip(body.spring_numbers, track.rows.springs, strict=True):
        drivers |= {f"xi0_{number}": response.xi0, f"gamma_{number}": response.gamma}
        drivers[f"ohms_{number}"] = response.resistance
    return {name: track.seen[name] for name in OUTPUTS}, drivers
