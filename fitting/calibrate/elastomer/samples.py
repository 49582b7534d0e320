"""The curves of a campaign as one stack of samples: what was pulled, how far, with how much noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.data.recordings import Recording, all_real, require_fitted
from fitting.inference.noise import robust_noise
from fitting.inference.readings import cautions, readings_of, stated_noise
from fitting.specimens.zeros import Zeros, offered, strain_from_taut, zeros_of
from pneusma_jax.errors import InputError, counted

FEWEST_SAMPLES = 12  # a law of six constants needs some samples over
RELATIVE_SPREAD = 0.05  # of the stress, in relative weighting
FLOOR = 1e-4  # least noise, as a fraction of the largest stress: a printed table has its rounding
MOST_SAMPLES = (
    3000  # of all recordings together; a curve needs no more, and every law is refitted some twenty times
)
WEIGHTINGS = ("absolute", "relative")


@dataclass(frozen=True)
class Curve:
    """One recording's part in the stack.

    Attributes:
        name: name of the recording.
        specimen: its specimen.
        role: `fit` or `validation`.
        noise: 1-sigma of the stress [Pa].
        noise_stated: the sidecar said so; otherwise it was estimated.
        rate: median of |d strain / d time| [1/s], or None without a clock.
        hysteresis: mean of stress going up minus going down, over the mean of both; None without a way down.
        zeros: zeros of strain and stress that the fit finds.
    """

    name: str
    specimen: str
    role: str
    noise: float
    noise_stated: bool
    rate: float | None
    hysteresis: float | None
    zeros: Zeros


@dataclass(frozen=True)
class Samples:
    """The samples of every recording, stacked in the order of sampling.

    Attributes:
        curves: one for each recording.
        strain: engineering strain [1], shape (n,).
        stress: engineering stress [Pa], shape (n,).
        spread: 1-sigma that the fit divides by [Pa], shape (n,).
        owner: index into `curves`, shape (n,).
        weighting: `absolute` (the instrument's noise) or `relative` (that, and 5 % of the stress).
        flat: rows at which a specimen hung slack, shape (n,).
        batch: relative 1-sigma between specimens of the material; 0 if they are exactly alike.
        real: measured (True), simulated (False; one simulated recording is enough), or nobody said (None).
        notices: assumptions and omissions, one sentence each.
    """

    curves: tuple[Curve, ...]
    strain: np.ndarray
    stress: np.ndarray
    spread: np.ndarray
    owner: np.ndarray
    weighting: str
    flat: np.ndarray
    batch: float
    real: bool | None
    notices: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.strain)

    @property
    def fitted(self) -> np.ndarray:
        """Mask of the samples whose recording may be fitted."""
        return np.array([curve.role == "fit" for curve in self.curves])[self.owner]

    @property
    def stretch(self) -> np.ndarray:
        """Axial stretch [1], shape (n,)."""
        return 1.0 + self.strain

    def rested(self, zeros: Mapping[Any, float]) -> tuple[np.ndarray, np.ndarray]:
        """Strain of the taut specimens and stress by the load cell's own zero, (n,) each.

        Args:
            zeros: values of recordings' zeros (`model.Zero`), SI.
        """
        strain, stress = self.strain.copy(), self.stress.copy()
        for zero, value in zeros.items():
            mine = self.of(zero.curve)
            if zero.quantity == "stress":
                stress[mine] -= value
            else:
                strain[mine] = np.asarray(strain_from_taut(strain[mine], value, self.flat[mine]))
        return strain, stress

    def of(self, index: int) -> np.ndarray:
        """Mask of the samples of one recording."""
        return self.owner == index

    def series(self, values: np.ndarray, mask: np.ndarray) -> list[np.ndarray]:
        """Values of the masked samples, one array for each recording that has any."""
        groups = (values[self.of(k) & mask] for k in range(len(self.curves)))
        return [group for group in groups if len(group)]

    def specimens(self) -> list[str]:
        """Specimens of the recordings that may be fitted, in order."""
        return list(dict.fromkeys(curve.specimen for curve in self.curves if curve.role == "fit"))


def stack(
    recordings: list[Recording], max_strain: float | None = None, weighting: str = "absolute"
) -> Samples:
    """Stack the recordings of elastomers.

    Args:
        recordings: recordings of kind `elastomer`, of either role; at least one with `role = fit`.
        max_strain: engineering strain beyond which samples are left out; None for all.
        weighting: see `Samples`.

    Raises:
        InputError: if no recording may be fitted, one has too few usable samples or never leaves zero strain.
    """
    require_fitted(recordings, recordings[0].path or recordings[0].name)
    curves, parts, notices = [], [], []
    total = sum(len(recording) for recording in recordings)
    for recording in recordings:
        strain, stress, kept = _usable(recording, max_strain)
        curve = _curve(recording, strain, stress, kept)
        sure = ~curve.zeros.unsure(strain)
        strain, stress = strain[sure], stress[sure]
        if not sure.all():
            notices.append(
                f"{recording.name}: {counted(np.sum(~sure), 'row')} beside the start of the rise left out,"
                " which cannot tell slack from strain"
            )
        step = -(-total // MOST_SAMPLES)
        notices += [f"{recording.name}: {notice}" for notice in recording.notices]
        if step > 1:
            notices.append(f"{recording.name}: one in {step} of its {len(strain)} samples was used")
        lost = int(np.sum(~(np.isfinite(recording.si("strain")) & np.isfinite(recording.si("stress")))))
        if lost and max_strain is None:
            notices.append(
                f"{recording.name}: {counted(lost, 'row')} without strain or stress left out"
            )
        strain, stress = strain[::step], stress[::step]
        spread = np.full(len(strain), curve.noise)
        if weighting == "relative":
            spread = np.hypot(spread, RELATIVE_SPREAD * np.abs(stress))
        flat = curve.zeros.flat(strain)
        parts.append((strain, stress, spread, np.full(len(strain), len(curves)), flat))
        curves.append(curve)
    strain, stress, spread, owner, flat = (np.concatenate(column) for column in zip(*parts, strict=True))
    notices += cautions(recordings) + offered(recordings)
    batch = max(recording.full_tolerance().get("silicone_stiffness", 0.0) for recording in recordings)
    return Samples(
        tuple(curves), strain, stress, spread, owner, weighting, flat, batch, all_real(recordings),
        tuple(notices),
    )  # fmt: skip


def _usable(recording: Recording, max_strain: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    strain, stress = recording.si("strain"), recording.si("stress")
    kept = np.isfinite(strain) & readings_of(recording, "stress").counted
    if max_strain is not None:
        kept &= strain <= max_strain
    place = recording.path or recording.name
    if kept.sum() < FEWEST_SAMPLES:
        limit = "" if max_strain is None else f" up to strain {max_strain:g}"
        raise InputError(
            f"{place}: {counted(kept.sum(), 'usable row')}{limit}, but a curve needs {FEWEST_SAMPLES} or more"
        )
    for name, values, unit in (("strain", strain[kept], "1"), ("stress_kPa", stress[kept], "kPa")):
        if np.ptp(values) == 0.0:
            raise InputError(
                f"{place}, column {name}: every row holds {values[0]:g} {unit}; a test that moves is needed"
            )
    return strain[kept], stress[kept], kept


def _curve(recording: Recording, strain: np.ndarray, stress: np.ndarray, kept: np.ndarray) -> Curve:
    stated = stated_noise(recording, "stress")
    noise = robust_noise(strain, stress) if stated is None else stated
    rate = None
    if recording.has("time"):
        time = recording.si("time")[kept]
        step = np.diff(time)
        moving = (step > 0.0) & (np.abs(np.diff(strain)) > 0.0)
        rate = float(np.median(np.abs(np.diff(strain)[moving]) / step[moving])) if moving.any() else None
    return Curve(
        name=recording.name,
        specimen=recording.specimen,
        role=recording.role,
        noise=max(noise, FLOOR * float(np.max(np.abs(stress)))) if stated is None else noise,
        noise_stated=stated is not None,
        rate=rate,
        hysteresis=_hysteresis(strain, stress),
        zeros=zeros_of(recording),
    )


def _hysteresis(strain: np.ndarray, stress: np.ndarray) -> float | None:
    """Loading minus unloading stress at equal strain, relative; None where strain goes one way only."""
    step = np.diff(strain)
    middle, level = 0.5 * (strain[1:] + strain[:-1]), 0.5 * (stress[1:] + stress[:-1])
    up, down = step > 0.0, step < 0.0
    if min(up.sum(), down.sum()) < 0.1 * len(step):
        return None
    edges = np.linspace(middle.min(), middle.max(), 11)
    bins = np.clip(np.digitize(middle, edges) - 1, 0, 9)
    both = [b for b in range(10) if (up & (bins == b)).any() and (down & (bins == b)).any()]
    rising = np.array([level[up & (bins == b)].mean() for b in both])
    falling = np.array([level[down & (bins == b)].mean() for b in both])
    scale = np.mean(np.abs(rising) + np.abs(falling)) / 2.0 if both else 0.0
    return float(np.mean(rising - falling) / scale) if scale > 0.0 else None
