"""Figures of the fit of an elastomer: the curve, its residuals, drift and held-out error over the range."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fitting.calibrate.elastomer.analysis import Analysis
from fitting.calibrate.elastomer.held_out import RangeFit
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation
from fitting.calibrate.elastomer.stability import ACTUATOR_STRAIN

from ..figures import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    axis_label,
    legend_over,
    residual_label,
    shared_legend,
    thinned,
)
from ..report import Picture

COLOURS = {
    "polynomial": GREY,
    "neo_hookean": VERMILION,
    "yeoh": GREEN,
    "gent": PURPLE,
    "ogden_1": SKY,
    "ogden_2": BLUE,
    "ogden_3": BLACK,
}
RECORDINGS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION)
MARKERS = "osD^vP*X"
POINTS = 300
MOST_MARKS = 90
"""Maximum number of marks of all recordings together; more would overlap. Each recording has at least one."""
COMPRESSED = -0.05
"""Strain below which a fit has seen compression; also how far below the measurements a law may be drawn."""


def pictures(result: ElastomerCharacterisation) -> dict[str, Picture]:
    """Every figure by name; those over ranges only if there are several ranges."""
    drawn = [
        Picture(
            "fit",
            "Measured engineering stress with every law; the one taken is drawn thick. Right: an actuator's "
            f"strains; laws part where nothing was fitted.{_shifted(result)}",
            lambda: fit_figure(result),
        ),
        Picture(
            "residuals",
            "Measured less model, of each law. Noise would scatter around zero; slow waves are the shape of "
            "the curve.",
            lambda: residual_figure(result),
        ),
        Picture(
            "drift",
            "Initial shear modulus over the range that was fitted. A law of the right shape gives one "
            "number.",
            lambda: drift_figure(result.whole),
        ),
        Picture(
            "held_out",
            "Left and middle: relative error where a law was fitted, and on the next stretch, which it had "
            "not seen. Right: error in gaps of the curve that were left out of the fit.",
            lambda: held_out_figure(result.whole),
        ),
    ]
    several = len(next(iter(result.whole.held.values())).ranges) > 1
    return {picture.name: picture for picture in (drawn if several else drawn[:2])}


def _shifted(result: ElastomerCharacterisation) -> str:
    """Sentence on the zeros of strain and stress in the figure of the fit, if there are any."""
    if not (result.whole.best.zeros or result.actuator.best.zeros):
        return ""
    return " Marks are shifted by the zeros of the thick law alone; other laws found zeros of their own."


def _axes(columns: int, width: float = 9.6, height: float = 4.2, **kwargs) -> tuple[Figure, np.ndarray]:
    drawing = Figure(figsize=(width, height), layout="constrained")
    return drawing, drawing.subplots(1, columns, squeeze=False, **kwargs)[0]


def fit_figure(result: ElastomerCharacterisation) -> Figure:
    """Measured curve with every law: the whole range, and an actuator's range with the laws fitted to it."""
    drawing, (left, right) = _axes(2)
    _curves(left, result, result.whole, (result.whole.strain_min, result.whole.strain_max))
    left.set_title("laws fitted to the whole range")
    low = min(result.samples.strain.min(), ACTUATOR_STRAIN[0])
    _curves(right, result, result.actuator, (low, min(result.samples.strain.max(), ACTUATOR_STRAIN[1])))
    end = "an actuator's strains" if result.actuator is not result.whole else "the same laws"
    squeezed = result.samples.strain[result.samples.fitted].min() < COMPRESSED
    right.set_title(end if squeezed else f"{end}, no compression fitted")
    legend_over(drawing, *left.get_legend_handles_labels(), columns=5)
    return drawing


def _curves(
    axes: Axes, result: ElastomerCharacterisation, analysis: Analysis, span: tuple[float, float]
) -> None:
    samples = result.samples
    strains, stresses = analysis.best.rested(samples)
    shown = (strains >= span[0]) & (strains <= span[1])
    for k, curve in enumerate(samples.curves):
        part = np.flatnonzero(samples.of(k) & shown)
        part = thinned(part, max(MOST_MARKS // len(samples.curves), 1))
        label = curve.name + (" (validation)" if curve.role == "validation" else "")
        axes.plot(
            1.0 + strains[part], stresses[part] / 1e3, MARKERS[k % len(MARKERS)], ms=3.2, mew=0.6,
            color=BLACK, markerfacecolor="none", zorder=4, label=label if len(samples.curves) <= 6 else None,
        )  # fmt: skip
    strain = np.linspace(*span, POINTS)
    limits = stresses[shown] / 1e3
    room = 0.15 * np.ptp(limits)
    worst = limits.min() - (4.0 * room if span[0] < samples.strain.min() + COMPRESSED else room)
    for name, fit in analysis.fits.items():
        chosen = name == analysis.choice.chosen
        axes.plot(
            1.0 + strain, fit.stress(strain) / 1e3, color=COLOURS[name], lw=2.8 if chosen else 1.2,
            ls="-" if chosen else "--", label=fit.law.label, zorder=3 if chosen else 2,
        )  # fmt: skip
    axes.set_ylim(worst, limits.max() + room)
    axes.set_xlabel("stretch [1]")
    axes.set_ylabel(axis_label("stress_kPa"))


def residual_figure(result: ElastomerCharacterisation) -> Figure:
    """Figure of measured less fitted stress: the chosen law by recording with the noise, and every law."""
    samples = result.samples
    drawing, (left, right) = _axes(2)
    model = result.best.predict(samples)
    noise = max(curve.noise for curve in samples.curves) / 1e3
    left.axhspan(-2 * noise, 2 * noise, color=SKY, alpha=0.25, lw=0, label="± 2 sigma of the noise")
    for k, curve in enumerate(samples.curves):
        part = samples.of(k)
        look = {"ls": ":", "lw": 1.2} if curve.role == "validation" else {"ls": "-", "lw": 0.9}
        label = f"{curve.name} (validation)" if curve.role == "validation" else curve.name
        colour = RECORDINGS[k % len(RECORDINGS)]
        left.plot(
            samples.stretch[part], (samples.stress - model)[part] / 1e3, color=colour, label=label, **look
        )
    left.set_title(f"{result.best.law.label}, by recording")
    for name, fit in result.whole.fits.items():
        rest = (samples.stress - fit.predict(samples)) / 1e3
        for k in range(len(samples.curves)):
            part = samples.of(k) & samples.fitted
            right.plot(
                samples.stretch[part],
                rest[part],
                color=COLOURS[name],
                lw=0.9,
                label=None if k else fit.law.label,
            )
    right.set_title("every law, recordings that were fitted")
    for axes in (left, right):
        axes.axhline(0.0, color=BLACK, lw=0.8)
        axes.set_xlabel("stretch [1]")
        axes.set_ylabel(residual_label("stress_kPa"))
        axes.legend(ncols=2 if axes is right else 1)
    return drawing


def drift_figure(analysis: Analysis) -> Figure:
    """Figure of every law's initial shear modulus over the largest stretch of its fit."""
    drawing, (axes,) = _axes(1, 7.2, 4.4)
    for k, (name, held) in enumerate(analysis.held.items()):
        reach = np.array([r.reach for r in held.ranges])
        modulus, sd = np.array([r.fit.shear_modulus() for r in held.ranges]).T / 1e3
        shift = 1.0 + 0.006 * (k - len(analysis.held) / 2.0)  # so that error bars do not hide each other
        chosen = name == analysis.choice.chosen
        axes.errorbar(
            reach * shift,
            modulus,
            2.0 * sd,
            color=COLOURS[name],
            marker="o",
            ms=4,
            lw=2.2 if chosen else 1.1,
            capsize=2.5,
            label=analysis.fits[name].law.label,
        )
    best = [r.fit.shear_modulus()[0] / 1e3 for held in analysis.held.values() for r in held.ranges]
    axes.set_ylim(min(0.0, np.percentile(best, 2)), 1.15 * np.percentile(best, 98))
    _range_axis(axes, reach)
    axes.set_ylabel("initial shear modulus ± 2 standard errors [kPa]")
    shared_legend(drawing)
    return drawing


def _range_axis(axes: Axes, reach: np.ndarray) -> None:
    axes.set_xscale("log")
    axes.set_xticks(reach, [f"{r:.3g}" for r in reach])
    axes.minorticks_off()
    axes.set_xlabel("largest stretch that was fitted [1]")


def held_out_figure(analysis: Analysis) -> Figure:
    """Figure of the error within and beyond the range of a fit, over that range; and in gaps of the curve."""
    drawing, (inside, following, gaps) = _axes(3, 10.5, 4.2)
    for name, held in analysis.held.items():
        look = {"color": COLOURS[name], "ms": 4, "lw": 1.2}
        if name == analysis.choice.chosen:
            look |= {"ms": 6, "lw": 3.0, "zorder": 1.5}  # visible below a law with the same values
        partial = [r for r in held.ranges if r.following is not None]
        reach = np.array([r.reach for r in held.ranges])
        label = analysis.fits[name].law.label
        inside.plot(reach, _errors(held.ranges, "inside"), "o-", label=label, **look)
        following.plot([r.reach for r in partial], _errors(partial, "following"), "o-", **look)
        middle = [0.5 * (low + high) for low, high, _ in held.bands]
        gaps.plot(middle, [s.rmse / 1e3 for *_, s in held.bands], "o-", **look)
    for axes, title in ((inside, "where it was fitted"), (following, "on the next range of stretch")):
        axes.set_yscale("log")
        _range_axis(axes, reach)
        axes.set_ylabel("relative error [%]")
        axes.set_title(title)
    gaps.set_yscale("log")
    gaps.set_xlabel("stretch in the middle of the gap [1]")
    gaps.set_ylabel("root mean square error [kPa]")
    gaps.set_title("in gaps left out of the fit")
    drawing.legend(*inside.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return drawing


def _errors(ranges: list[RangeFit], which: str) -> list[float]:
    return [100.0 * getattr(r, which).rpd for r in ranges]
