"""The interface of a kind of specimen: what depends on the kind, and nothing else does.

`Specimen` has no optional methods. Who calls what:

| method or attribute | caller |
|---|---|
| `rows_for`, `parameters_for`, `residual`, `predict` | `calibrate` (fits), `sample` (posteriors), `plan` |
| `decides`, `decided` | `calibrate`: decisions that are not smooth in the parameters, between two fits |
| `answer` with effects, `explained`, `latent`, `most_rows_with_effects`, `compiler_options` | `diagnose` |
| `answer` at every row (`simulation.py`), `drivers`, `cautions`, `states` | `simulate`, `synthesise` |
| `influences`, `loads`, `located` | `diagnose`: what was varied, what to vary next, where a misfit is |
| `tables`, `options`, `element`, `letter` | `saved_models`, `with_saved_model`: models on disk |
| `identified`, `starts`, `profiled`, `unseen` | `calibrate` |
| `over` | whoever draws or scores an output over an input |
| `noun`, `law` | `report`: words |

The base model is `effects=()`.
"""

import abc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign, Recording
from fitting.data.recordings.schema import Kind
from fitting.inference.parameters import Parameters
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.pipeline import Effect

from .latent import LatentStates, NoLatentStates
from .rows import MOST_ROWS, Rows
from .thermal_runs import FirstHeating

FEWEST = 4
"""Minimum number of complete rows for a fit."""
EVERY = 1_000
"""Number of parameters to profile that no campaign has: all of them."""
ASTRAY = 30.0
"""Standard deviations for which a row counts in which the model has no answer."""


@dataclass(frozen=True)
class RowOptions:
    """How a recording becomes arrays.

    Attributes:
        most: maximum number of rows; longer recordings are reduced. None keeps every row.
        fewest: minimum number of rows with all drivers.
        smooth: noisy drivers are smoothed, of kinds that smooth any.
        compared: measured outputs get weights. Without, nothing is compared with the model.
    """

    most: int | None = MOST_ROWS
    fewest: int = FEWEST
    smooth: bool = True
    compared: bool = True


Courses = Mapping[str, np.ndarray]
"""Quantities of one recording by name, each of shape (rows,), without padding."""
FITTED = RowOptions()
"""As fits, samplers and diagnoses take recordings."""


class Model(abc.ABC):
    """What predicts recordings of one kind from named parameters: all that a fit or a sampler needs.

    `predict` and `residual` are pure functions of their arguments and may be traced.

    Attributes:
        kind: of the recordings.
        outputs: quantities that are predicted.
    """

    kind: str
    outputs: tuple[str, ...]
    astray: float = ASTRAY

    @property
    @abc.abstractmethod
    def specimen(self) -> "Specimen":
        """What is recorded."""

    @abc.abstractmethod
    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """Every recording of a campaign as arrays, in its order.

        Args:
            campaign: recordings of this kind.
            **tables: to start from, such as `base` (an alloy) or `material` (a silicone).

        Raises:
            InputError: if the recordings cannot be used, or name tables that cannot be used together.
        """

    @abc.abstractmethod
    def parameters_for(self, campaign: Campaign, **tables: Any) -> Parameters:
        """Free numbers of a campaign with what is known about them; arguments as for `rows_for`."""

    @abc.abstractmethod
    def predict(self, values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
        """Outputs of one recording by quantity, SI; NaN in rows where the model has no answer.

        Args:
            values: free parameters by name, SI.
            rows: one recording.
        """

    def residual(self, values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Misfit of one recording in standard deviations."""
        return self.misfit(self.predict(values, rows), rows)

    def misfit(self, found: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """What predictions miss, in standard deviations; `astray` in rows without an answer."""
        parts = []
        for name in (name for name in self.outputs if name in rows.weight):
            there, weight = jnp.isfinite(found[name]), rows.weight[name]
            missed = weight * (jnp.where(there, found[name], 0.0) - rows.measured[name])
            parts.append(jnp.where(there | (weight == 0.0), missed, self.astray))
        return jnp.concatenate(parts)

    def observations(self, recordings: Sequence[Rows]) -> int:
        """Measured values that count."""
        return sum(rows.observations for rows in recordings)

    def decides(self, recordings: Sequence[Rows]) -> bool:
        """Whether anything depends on the parameters without being smooth in them. Then fits and decisions
        alternate."""
        return False

    def decided(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings with those decisions as they are at these parameters."""
        return recordings

    def prepared(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings as a prediction at these parameters takes them."""
        return self.decided(values, recordings) if self.decides(recordings) else recordings


class Specimen(Model):
    """One kind of specimen. The module's docstring says who calls what.

    Attributes:
        recording: how its recordings are written down.
        letter: of the kind in `Effect.kinds`.
        noun: what reports call it.
        law: its base law in words.
        over: quantity that fitted outputs are drawn over; `time` for the clock.
        simulated_over: the same for simulated recordings.
        tables: kinds of calibration table whose numbers its rows hold; of equal names the first counts.
        options: names of the tables that `rows_for` takes.
        identified: key of `[geometry]` for which `"fit"` asks to identify a material from these recordings
            alone; empty if there is none.
        several_laws: `characterise` chooses its base law from several.
        sized: whether its answer depends on dimensions that a recording should state.
        loads: input that a repeated test may make larger; empty if none.
        starts, profiled: fits from scattered starts, and parameters whose profiles are made, by default.
        starts_with_model: fits where a model on disk is fitted.
        element: name by which slots of effects know the specimen: `actuator`, `spring`, `wire`, `silicone`.
        wall_drivers: what a correction of the silicone's stiffness may follow.
        explained: outputs that effects act on; those that a diagnosis compares.
        most_rows_with_effects: maximum number of rows where effects act.
        compiler_options: of the compiled program of a diagnosis.
    """

    recording: Kind
    letter: str
    noun: str
    law: str
    over: str = "time"
    simulated_over: str = "time"
    tables: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    identified: str = ""
    several_laws: bool = False
    sized: bool = True
    loads: str = ""
    starts: int = 3
    profiled: int = 0
    starts_with_model: int = 3
    element: str
    wall_drivers: tuple[str, ...] = ()
    most_rows_with_effects: int = MOST_ROWS
    compiler_options: Mapping[str, bool] | None = None

    @property
    def kind(self) -> str:
        """Of the recordings."""
        return self.recording.name

    @property
    def specimen(self) -> "Specimen":
        """Itself."""
        return self

    @property
    def explained(self) -> tuple[str, ...]:
        """Outputs that effects act on."""
        return self.outputs

    @property
    def latent(self) -> LatentStates:
        """Hidden states under effects; none by default."""
        return NoLatentStates(self.rows_for)

    @abc.abstractmethod
    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """Quantities without which a row of this recording says nothing, the clock left out."""

    @abc.abstractmethod
    def rows_for(self, campaign: Campaign, options: RowOptions = FITTED, **tables: Any) -> list[Rows]:
        """Every recording of a campaign as arrays, in its order.

        Args:
            campaign: recordings of this kind.
            options: which rows are taken, and how.
            **tables: to start from, by the names in `options` of the class.

        Raises:
            InputError: if the recordings cannot be used, or name tables that cannot be used together.
        """

    @abc.abstractmethod
    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """The forward model: outputs of one recording as its instruments show them, and what drives them.

        Args:
            values: free parameters by name, SI.
            rows: one recording.
            effects: beyond the base model; their memories start at rest.

        Returns:
            Outputs by quantity, SI, each of shape (rows,), NaN where there is no answer; with remainders also
            `unmodelled_QUANTITY` and `beyond_QUANTITY`. Drivers by the name that reports use (`pressure`,
            `xi0_2`, ...).
        """

    def predict(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> dict[str, Float[Array, " rows"]]:
        """The outputs of `answer`."""
        return self.answer(values, rows, effects)[0]

    def influences(self, recording: Recording) -> tuple[str, ...]:
        """Measured quantities that can change the outputs, of those that the recording has."""
        return tuple(name for name in self.drivers(recording) if recording.has(name))

    def cautions(self, recording: Recording, rows: Rows, outputs: Courses, drivers: Courses) -> list[str]:
        """What to read with care in a simulated recording, in words; arguments without padding."""
        return []

    def states(self, rows: Rows, drivers: Courses) -> dict[str, np.ndarray]:
        """What a simulation says of each row beside the outputs, by name."""
        return {}

    def located(self, component: str, recordings: Sequence[Recording], slug: str) -> str:
        """Where a report locates a misfit, from the component of the catalogue.

        Args:
            component: of the effect.
            recordings: of the campaign.
            slug: of the effect; empty for a misfit that no effect explains.
        """
        return component

    def simpler(self, campaign: Campaign, **tables: Any) -> tuple[dict[str, Any], str]:
        """Tables of a simpler law, for recordings that the whole law does not fit, and words for it.

        Returns:
            Tables as `rows_for` takes them, empty if there is no simpler law; a few words.
        """
        return {}, ""

    def unseen(self, campaign: Campaign, **tables: Any) -> dict[str, Quantity]:
        """Constants that no recording shows, so that they are held, by name."""
        return {}

    def alloy_quantities(self, campaign: Campaign, **tables: Any) -> dict[str, Quantity]:
        """Constants of the alloy that a campaign is fitted from, by name; empty without an alloy."""
        return {}

    def variant(self, campaign: Campaign) -> "Specimen":
        """The specimen that models these recordings, where columns decide between several."""
        return self

    def plotted_over(self, rows: Rows) -> str:
        """Quantity that the outputs of one recording are drawn over; `time` for the clock."""
        return self.over

    def check_diagnosable(self, recording: Recording) -> None:
        """Refuse a recording that can be fitted but not diagnosed.

        Raises:
            InputError: in one line.
        """

    def set_apart(self, recording: Recording) -> FirstHeating | None:
        """Rows at the beginning that are not fitted, and why; None if there are none."""
        return None

    def notes(self, campaign: Campaign) -> list[str]:
        """What was set aside of a campaign, a sentence each."""
        pairs = [(recording, self.set_apart(recording)) for recording in campaign.recordings]
        return [apart.text(recording.name) for recording, apart in pairs if apart is not None]
