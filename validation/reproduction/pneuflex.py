"""Figure 3.18: fibre-reinforced actuators without springs, and the influence of gravity on them."""

import dataclasses

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLUE, GREEN, VERMILION, style
from pneusma_jax.actuator.loads import Gravity, gravity_vector
from pneusma_jax.actuator.weight import mass_of, weight

from .bench import FULL_PRESSURE, SWEEP_ROWS, Bench, pressure_sweep
from .entry import Entry
from .expectation import Near, at_least, at_most
from .statement import Found, Statement

DESIGNS = {"s": ("standard", BLUE), "t": ("thicker walls", VERMILION), "w": ("wider tube", GREEN)}
QUOTED_GRAVITY = {
    "s": 8.2,
    "t": 9.7,
    "w": 4.3,
}  # %, largest change of the predicted curvature (Section 3.7.3)
UPWARDS = SWEEP_ROWS // 2 + 1  # Number of rows of a sweep up to the largest pressure
WALL_SPREAD = 0.03  # Relative tolerance of the wall's thickness in the shipped tables; the source gives none
STANDING = "vertical_base_down"  # Orientation clamped below: the weight adds to the bending, as in the source


def _density() -> float:
    return pj.load_calibration("dragon_skin_10_fast", kind="silicone").values()["density"]


def _curvature(bench: Bench, kind: str, key: str, change: object) -> np.ndarray:
    """Curvature over the rising part of a pressure sweep [1/m] of a changed actuator, computed once."""
    body = bench.actuator(f"pneuflex_{kind}")
    history = bench.keep(("pneuflex", kind, key), lambda: pj.simulate_history(change(body), pressure_sweep()))
    if not np.all(np.asarray(history.converged)):
        raise RuntimeError(f"PneuFLEX {kind}, {key}, must have an equilibrium in every row, but it has not.")
    return np.asarray(history.rows.curvature)[:UPWARDS]


def plain(bench: Bench, kind: str) -> np.ndarray:
    """Curvature without weight [1/m], shape (UPWARDS,)."""
    return np.asarray(bench.sweep(f"pneuflex_{kind}").rows.curvature)[:UPWARDS]


def under_gravity(bench: Bench, kind: str, at_tip: bool = False) -> np.ndarray:
    """Curvature of an actuator that is clamped below [1/m], shape (UPWARDS,).

    Args:
        bench: bench with the actuators.
        kind: name of one of `DESIGNS`.
        at_tip: true to put the whole weight on the end cap, as in the source's balance, not along the tube.
    """

    def loaded(body: pj.Actuator) -> pj.Actuator:
        spread = weight(body, _density(), gravity_vector(STANDING))
        at_end = Gravity(spread.acceleration, 0.0 * spread.mass, spread.place, spread.mass, spread.place)
        return body.with_loads(at_end if at_tip else spread)

    return _curvature(bench, kind, f"gravity {at_tip}", loaded)


def gravity_change(bench: Bench, kind: str, at_tip: bool = False) -> np.ndarray:
    """Change of the curvature by gravity over the rising pressure, from 2 kPa on [%]."""
    return 100.0 * (under_gravity(bench, kind, at_tip)[1:] / plain(bench, kind)[1:] - 1.0)


def _largest_increase(bench: Bench, kind: str, at_tip: bool) -> Found:
    change = gravity_change(bench, kind, at_tip)
    return Found(float(change.max()), f"at {1e-3 * pressure_sweep()[1 + int(change.argmax())]:g} kPa")


def _bends_more(bench: Bench) -> Found:
    """Share of designs and pressures in which weight makes the curvature larger [%]."""
    change = {k: gravity_change(bench, k) for k in DESIGNS}
    pressure = 1e-3 * pressure_sweep()[1:UPWARDS]
    detail = ", ".join(
        f"{k} from {pressure[c > 0.0].min():g} kPa on" for k, c in change.items() if np.any(c > 0.0)
    )
    return Found(100.0 * float(np.mean(np.stack(list(change.values())) > 0.0)), detail)


def _gravity_over_wall(bench: Bench) -> Found:
    """Largest increase by gravity over the largest change by a thinner wall, maximum over the designs [1]."""
    ratios = {}
    for kind in DESIGNS:
        thickness = float(pj.design_geometry(f"pneuflex_{kind}").wall_thickness) * (1.0 - WALL_SPREAD)
        design = f"pneuflex_{kind}"
        thinner = lambda body, d=design, t=thickness: pj.make_actuator(  # noqa: E731
            d, silicone=bench.silicone, wall_thickness=t
        )
        wall = 100.0 * (_curvature(bench, kind, "wall", thinner)[1:] / plain(bench, kind)[1:] - 1.0)
        ratios[kind] = float(gravity_change(bench, kind).max() / np.abs(wall).max())
    return Found(max(ratios.values()), ", ".join(f"{k} {v:.2f}" for k, v in ratios.items()))


def _masses(bench: Bench) -> Found:
    """Mass of the heaviest tube [g]."""
    each = {k: 1e3 * float(mass_of(bench.actuator(f"pneuflex_{k}"), _density())[0]) for k in DESIGNS}
    return Found(max(each.values()), ", ".join(f"{k} {v:.2f} g" for k, v in each.items()) + ", without caps")


def _order(bench: Bench, bend: bool) -> Found:
    """Share of the pressures at which t bends less than s, and s less than w [%]."""
    rows = {k: bench.sweep(f"pneuflex_{k}").rows for k in DESIGNS}
    values = {k: np.asarray(r.bend_angle if bend else r.curvature)[1:UPWARDS] for k, r in rows.items()}
    ordered = (values["t"] < values["s"]) & (values["s"] < values["w"])
    pressure = 1e-3 * pressure_sweep()[1:UPWARDS]
    detail = "" if np.all(ordered) else f"up to {pressure[ordered].max():g} kPa"
    return Found(100.0 * float(np.mean(ordered)), detail)


def _hysteresis(bench: Bench) -> float:
    """Largest difference between the way up and the way down [1/m]."""
    paths = [np.asarray(bench.sweep(f"pneuflex_{k}").rows.curvature) for k in DESIGNS]
    return max(float(np.abs(path - path[::-1]).max()) for path in paths)


def _fibre_stretch(bench: Bench) -> Found:
    """Elongation of the fibre's side at 60 kPa with a stiffness of 1e6 N/m [mm], and its effect."""
    body = bench.actuator("pneuflex_s")
    soft = dataclasses.replace(body, fibre_stiffness=jnp.asarray(1e6))
    found = pj.solve(soft, FULL_PRESSURE)
    off = float(found.curvature) / plain(bench, "s")[-1] - 1.0
    return Found(1e3 * abs(float(found.delta_2)), f"curvature off by {abs(off):.1e}")


def draw(bench: Bench) -> Figure:
    """Curvature over pressure of the three geometries, and its change by gravity."""
    with style():
        figure = Figure(figsize=(11.0, 4.8), layout="constrained")
        left, right = figure.subplots(1, 2)
        pressure = 1e-3 * pressure_sweep()[:UPWARDS]
        for kind, (words, colour) in DESIGNS.items():
            left.plot(pressure, plain(bench, kind), color=colour, label=f"PneuFLEX {kind}, {words}")
            left.plot(pressure, under_gravity(bench, kind), ":", color=colour)
            right.plot(pressure[1:], gravity_change(bench, kind), color=colour)
            right.plot(pressure[1:], gravity_change(bench, kind, at_tip=True), "--", color=colour)
            right.plot(
                pressure[-1] + 2.0, QUOTED_GRAVITY[kind], "<", color=colour, markersize=8, clip_on=False
            )
        left.plot([], [], ":", color="black", label="with gravity, clamped below")
        for look, words in (("-", "weight along the tube"), ("--", "the same weight on the end cap")):
            right.plot([], [], look, color="black", label=words)
        right.plot([], [], "<", color="black", markersize=8, label="largest change, quoted")
        right.axhline(0.0, color="black", linewidth=0.8)
        left.set(xlabel="gauge pressure [kPa]", ylabel="curvature [1/m]")
        right.set(
            xlabel="gauge pressure [kPa]", ylabel="change of curvature by gravity [%]", ylim=(-6.0, 16.0)
        )
        left.legend(loc="upper left")
        right.legend(loc="upper right")
    return figure


_GRAVITY_REASON = (
    "weight along the tube bends it about a quarter as much as on its end. The quoted numbers follow if the "
    "whole weight is put into the balance of the end cap (Eqs. 3.35, 3.36): see 3.18-11 to -13"
)
_NEARLY_STRAIGHT = (
    "at low pressure, still nearly straight, the weight mostly presses the tube down; its line of action "
    "lies beside the fibre, which bends the tube back"
)
_STATEMENTS = (
    Statement(
        "3.18-1", "Section 3.7.3", "no hysteresis between pressurisation and venting: largest "
        "difference", "1/m",
        at_most(0.01, 0.5), _hysteresis,
    ),
    *(
        Statement(
            f"3.18-{n}", "Section 3.7.3", f"gravity raises the curvature predicted for PneuFLEX {kind} by at "
            "most",
            "%", Near(QUOTED_GRAVITY[kind], 0.15, 0.50),
            lambda bench, kind=kind: _largest_increase(bench, kind, at_tip=False), _GRAVITY_REASON,
        )
        for n, kind in enumerate(DESIGNS, 2)
    ),
    Statement(
        "3.18-5", "Section 3.7.3", "weight makes the upright actuators bend more: share of designs and "
        "pressures", "%",
        at_least(100.0, 50.0), _bends_more, _NEARLY_STRAIGHT,
    ),
    Statement(
        "3.18-6", "Section 3.7.3", "the change by gravity lies well within that by the uncertain wall "
        "thickness (3 % here): largest ratio", "1", at_most(1.0, 2.0), _gravity_over_wall,
        "the source does not state the uncertainty of its wall; 3 % is ours",
    ),
    Statement(
        "3.18-7", "Section 3.7.3", "the actuators weigh less than", "g", at_most(2.5, quoted=True), _masses,
    ),
    Statement(
        "3.18-8", "Eq. 3.39", "a fibre of 1e6 (N/m) keeps its side at its length: elongation at 60 kPa", "mm",
        at_most(0.01, 0.1), _fibre_stretch,
    ),
    Statement(
        "3.18-9", "Fig. 3.18", "at equal pressure thick walls bend less and the wide tube more, in bend "
        "angle: share of the pressures",
        "%", at_least(100.0, 50.0), lambda bench: _order(bench, bend=True), stated=False,
    ),
    Statement(
        "3.18-10", "Fig. 3.18", "the same in curvature: share of the pressures", "%", at_least(100.0, 50.0),
        lambda bench: _order(bench, bend=False),
        "at high pressure the wide tube also lengthens more, which lowers its curvature", stated=False,
    ),
    *(
        Statement(
            f"3.18-{n}", "Sections 3.5.4 and 3.7.3", f"the same change for PneuFLEX {kind} with the whole "
            "weight on the end cap", "%", Near(QUOTED_GRAVITY[kind], 0.15, 0.50),
            lambda bench, kind=kind: _largest_increase(bench, kind, at_tip=True), stated=False,
        )
        for n, kind in enumerate(DESIGNS, 11)
    ),
)  # fmt: skip

ENTRIES = (
    Entry(
        "3.18", "Curvature of PneuFLEX actuators over pressure", "Section 3.7.3", draw,
        "Left: curvature without (solid) and with the tube's own weight (dotted), clamped below. Right: the "
        "change by that weight, along the tube or on its end, and the largest change that the source states "
        "(arrows).",
        "The measured curvatures are lost; the text says that the model tracks them well.", _STATEMENTS,
    ),
)  # fmt: skip
