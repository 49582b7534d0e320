"""The interface of a kind of specimen. Everything that depends on the kind is one of its methods or
attributes.

`Specimen` has no optional methods. The callers of each are:

| method or attribute | caller |
|---|---|
| `rows_for`, `parameters_for`, `residual`, `predict` | `calibrate` (fits), `sample` (posteriors), `plan` |
| `decides`, `decided` | `calibrate`: decisions that are not smooth in the parameters, between two fits |
| `answer` with effects, `explained`, `latent` | `diagnose` |
| `most_rows_with_effects`, `each_alone`, `differenced`, `compiler_options` | `diagnose`: its program |
| `answer` at every row (`simulation.py`), `drivers`, `cautions`, `states` | `simulate`, `synthesise` |
| `influences`, `loads`, `located` | `diagnose`: varied inputs, next experiment, place of a misfit |
| `tables`, `options`, `element`, `letter` | `saved_models`, `with_saved_model`: models on disk |
| `identified`, `starts`, `profiled`, `unseen` | `calibrate` |
| `over` | code that draws or scores an output over an input |
| `noun`, `law` | `report`: words |

The base model is `effects=()`.
"""

import abc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign, Recording
from fitting.data.recordings.schema import Kind
from fitting.inference.parameters import Parameters
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.model_discrepancy import UNITS, WALL
from pneusma_jax.pipeline import Effect

from .correlated_noise import independent
from .latent import LatentStates, NoLatentStates
from .priors import NEW_ALLOY
from .rows import MOST_ROWS, Rows, held
from .thermal_runs import FirstHeating

FEWEST = 4
"""Minimum number of complete rows for a fit."""
EVERY = 1_000
"""Number of parameters to profile that no campaign has: all of them."""
FAILED_RESIDUAL = 30.0
"""Residual of a row for which the model has no answer, in standard deviations."""
OF_HISTORIES = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 1}
"""Compiler options of a history with every effect, a long loop over small arrays.

The older code generation, which jax 0.11 no longer has, needs a fifth less time for it. The lower level
compiles an actuator's in 80 s of processor time instead of 150 s, and a run takes 39 ms instead of 32 ms.
That was measured on six recordings of 128 rows, on a loaded machine. A spring's compiles in 67 s instead of
75 s, and a run takes as long.
"""


@dataclass(frozen=True)
class RowOptions:
    """Options for the conversion of a recording to arrays.

    Attributes:
        most: maximum number of rows; longer recordings are reduced. None keeps every row.
        fewest: minimum number of rows with all drivers.
        smooth: true to smooth noisy drivers, for kinds that smooth any.
        compared: true to give measured outputs weights. Without, nothing is compared with the model.
    """

    most: int | None = MOST_ROWS
    fewest: int = FEWEST
    smooth: bool = True
    compared: bool = True


class SigmoidLaw(NamedTuple):
    """Names of the constants of a law `mean + span / 2 s(slope x + offset)`, s the algebraic sigmoid."""

    mean: str
    span: str
    slope: str
    offset: str
    sharpness: str


Courses = Mapping[str, np.ndarray]
"""Quantities of one recording by name, each of shape (rows,), without padding."""
FITTED = RowOptions()
"""Options of fits, samplers and diagnoses."""


class Model(abc.ABC):
    """A model of recordings of one kind with named parameters: the interface that fits and samplers need.

    `predict` and `residual` are pure functions of their arguments and may be traced.

    Attributes:
        kind: kind of the recordings.
        outputs: names of the predicted quantities.
        searches: true if a prediction holds a search that ends within a tolerance. Differences of two
            predictions are then no derivatives.
        in_turn: true if recordings are predicted one after another, not side by side. That is worth it where
            a row skips what it does not need: outputs of three tubes with an effect take 12 ms for 44, and
            derivatives by seven numbers 22 for 73. Outputs of four actuators take 16 ms for 52.
    """

    kind: str
    outputs: tuple[str, ...]
    failed_residual: float = FAILED_RESIDUAL
    searches: bool = False
    in_turn: bool = False

    @property
    @abc.abstractmethod
    def specimen(self) -> "Specimen":
        """Kind of specimen that is recorded."""

    @abc.abstractmethod
    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """Recordings of a campaign as arrays, in their order.

        Args:
            campaign: recordings of this kind.
            **tables: names or paths of start tables, such as `base` (an alloy) or `material` (a silicone).

        Raises:
            InputError: if the recordings cannot be used, or name tables that cannot be used together.
        """

    @abc.abstractmethod
    def parameters_for(self, campaign: Campaign, **tables: Any) -> Parameters:
        """Free parameters of a campaign with their priors; arguments as for `rows_for`."""

    @abc.abstractmethod
    def predict(self, values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
        """Outputs of one recording by quantity, SI; NaN in rows where the model has no answer.

        Args:
            values: free parameters by name, SI.
            rows: one recording.
        """

    def residual(self, values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Weighted residual of one recording, in standard deviations."""
        return self.misfit(self.predict(values, rows), rows)

    def misfit(self, found: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Prediction minus measurement in standard deviations; `failed_residual` in rows without an answer.

        Correlated noise is made independent (`correlated_noise`).
        """
        parts = []
        for name in (name for name in self.outputs if name in rows.weight):
            finite, weight = jnp.isfinite(found[name]), rows.weight[name]
            missed = weight * (jnp.where(finite, found[name], 0.0) - rows.measured[name])
            missed = jnp.where(finite | (weight == 0.0), missed, self.failed_residual)
            parts.append(independent(rows, name, missed))
        return jnp.concatenate(parts)

    def observations(self, values: Mapping[str, float], recordings: Sequence[Rows]) -> int:
        """Number of measured values that count at these parameters, less those that hidden states use up."""
        return sum(rows.observations for rows in recordings)

    def decides(self, recordings: Sequence[Rows]) -> bool:
        """True if the prediction depends on the parameters in a non-smooth way. Fits then alternate with
        decisions."""
        return False

    def decided(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings with the non-smooth decisions that hold at these parameters."""
        return recordings

    def prepared(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings ready for a prediction at these parameters."""
        return self.decided(values, recordings) if self.decides(recordings) else recordings


class Specimen(Model):
    """One kind of specimen. The module's docstring lists the callers of each method.

    Attributes:
        recording: schema of its recordings.
        letter: letter of the kind in `Effect.kinds`.
        noun: name in reports.
        law: base law in words.
        over: quantity on the horizontal axis of fitted outputs; `time` for the clock.
        simulated_over: quantity on the horizontal axis of simulated outputs.
        tables: kinds of calibration table whose constants its rows hold; of equal names the first counts.
        options: names of the table arguments of `rows_for`.
        identified: keys of `[geometry]` whose value `"fit"` asks to identify an alloy or a material from
            these recordings alone.
        new_alloy: table that the identification of an alloy begins at.
        several_laws: true if `characterise` chooses the base law among several.
        sized: true if the answer depends on dimensions that a recording should state.
        loads: input that a repeated test may increase; empty if none.
        starts, profiled: default numbers of scattered starts and of parameters with a likelihood profile.
        starts_with_model: default number of starts where a model on disk is fitted.
        element: name of the specimen in slots of effects: `actuator`, `spring`, `wire`, `silicone`.
        wall_drivers: possible drivers of a correction of the silicone's stiffness.
        output_drivers: possible drivers of a correction of an output.
        explained: outputs that effects change and a diagnosis compares.
        most_rows_with_effects: maximum number of rows where effects act.
        each_alone: true if a diagnosis runs recordings one by one, side by side on all cores. It is worth it
            where a recording takes milliseconds.
        differenced: true if `answer` has derivatives by finite differences in a diagnosis. Its program then
            has no tangents, and is the same whichever constants are free.
        compiler_options: XLA options of a diagnosis's compiled program.
        sigmoid_law: law between two plateaus whose constants a posterior samples by the law's ends; None for
            none.
    """

    recording: Kind
    letter: str
    noun: str
    law: str
    over: str = "time"
    simulated_over: str = "time"
    tables: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    identified: tuple[str, ...] = ()
    new_alloy: str = NEW_ALLOY
    several_laws: bool = False
    sized: bool = True
    loads: str = ""
    starts: int = 3
    profiled: int = 0
    starts_with_model: int = 3
    element: str
    wall_drivers: tuple[str, ...] = ()
    output_drivers: tuple[str, ...] = tuple(name for name in UNITS if name != WALL)
    most_rows_with_effects: int = MOST_ROWS
    each_alone: bool = False
    differenced: bool = False
    compiler_options: Mapping[str, bool | int] | None = None
    sigmoid_law: SigmoidLaw | None = None

    def __repr__(self) -> str:
        """Name by which traced programs are stored. A kind from outside this package has no lasting one: a
        change of its source would not be seen."""
        if type(self).__module__.partition(".")[0] != "fitting":
            return super().__repr__()
        return f"{type(self).__qualname__}({vars(self)})"

    @property
    def kind(self) -> str:
        """Kind of the recordings."""
        return self.recording.name

    @property
    def specimen(self) -> "Specimen":
        """The specimen itself."""
        return self

    @property
    def explained(self) -> tuple[str, ...]:
        """Outputs that effects change."""
        return self.outputs

    @property
    def latent(self) -> LatentStates:
        """Latent states under effects; none by default."""
        return NoLatentStates(self.rows_for)

    @abc.abstractmethod
    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """Quantities that a row of this recording must have, apart from the clock."""

    @abc.abstractmethod
    def rows_for(self, campaign: Campaign, options: RowOptions = FITTED, **tables: Any) -> list[Rows]:
        """Recordings of a campaign as arrays, in their order.

        Args:
            campaign: recordings of this kind.
            options: selection and treatment of rows.
            **tables: names or paths of start tables, by the names in `options` of the class.

        Raises:
            InputError: if the recordings cannot be used, or name tables that cannot be used together.
        """

    @abc.abstractmethod
    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """The forward model: instrument readings of one recording, and the quantities that drive them.

        Args:
            values: free parameters by name, SI.
            rows: one recording.
            effects: effects beyond the base model; their memories start at rest.

        Returns:
            Outputs by quantity, SI, each of shape (rows,), NaN where there is no answer. Model discrepancies
            add `unmodelled_QUANTITY` and `beyond_QUANTITY`. Second, drivers by the name that reports use
            (`pressure`, `xi0_2`, ...).
        """

    def predict(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> dict[str, Float[Array, " rows"]]:
        """Outputs of `answer`."""
        return self.answer(values, rows, effects)[0]

    def influences(self, recording: Recording) -> tuple[str, ...]:
        """Measured quantities of a recording that can change the outputs."""
        return tuple(name for name in self.drivers(recording) if recording.has(name))

    def cautions(self, recording: Recording, rows: Rows, outputs: Courses, drivers: Courses) -> list[str]:
        """Warnings about a simulated recording, in words; arguments without padding."""
        return []

    def states(self, rows: Rows, drivers: Courses) -> dict[str, np.ndarray]:
        """Further states of each row for a simulation's table, by name."""
        return {}

    def located(self, component: str, recordings: Sequence[Recording], slug: str) -> str:
        """Place of a misfit in a report, from the component in the catalogue.

        Args:
            component: component of the effect.
            recordings: recordings of the campaign.
            slug: slug of the effect; empty for a misfit that no effect explains.
        """
        return component

    def simpler(self, campaign: Campaign, **tables: Any) -> tuple[dict[str, Any], str]:
        """Tables of a simpler law, for recordings that the whole law does not fit, and a description of it.

        Returns:
            Tables as `rows_for` takes them, empty if there is no simpler law; and a few words.
        """
        return {}, ""

    def unseen(self, campaign: Campaign, **tables: Any) -> dict[str, Quantity]:
        """Constants with a prior that recordings show only by their share in others, by name.

        `parameters_for` leaves them out, so a diagnosis holds them. A characterisation frees them.
        """
        return {}

    def alloy_quantities(self, campaign: Campaign, **tables: Any) -> dict[str, Quantity]:
        """Constants of the alloy that a campaign is fitted from, by name; empty without an alloy."""
        return {}

    def variant(self, campaign: Campaign) -> "Specimen":
        """The specimen that models these recordings, where their columns decide between several."""
        return self

    def plotted_over(self, rows: Rows) -> str:
        """Quantity on the horizontal axis of one recording's outputs; `time` for the clock.

        It is the clock, too, where that quantity stands still in most rows.
        """
        return "time" if self.over not in rows.inputs or held(rows, self.over) else self.over

    def check_diagnosable(self, recording: Recording) -> None:
        """Refuse a recording that can be fitted but not diagnosed.

        Raises:
            InputError: in one line.
        """

    def set_apart(self, recording: Recording) -> FirstHeating | None:
        """First rows that are excluded from the fit, with the reason; None if there are none."""
        return None

    def notes(self, campaign: Campaign) -> list[str]:
        """Sentences about the rows of a campaign that are excluded from the fit."""
        pairs = [(recording, self.set_apart(recording)) for recording in campaign.recordings]
        return [excluded.text(recording.name) for recording, excluded in pairs if excluded is not None]
