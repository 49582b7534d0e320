"""Figure 3.2: shapes of an actuator whose springs are heated in regions, as a chain of segments."""

import jax
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLACK, GREY, style
from pneusma_jax.serial_chain.weight import chain_weight

from .bench import HOT, Bench, listed
from .entry import Entry
from .expectation import Interval, at_least, at_most
from .statement import Found, Statement

REGIONS = 4  # Number of separately heated regions; a region is a segment of the actuator's length
LENGTH = 28e-3  # Length of a region [m]; the source's is lost
PRESSURE = 20e3  # Gauge pressure [Pa]
WARM = 0.5  # Martensite fraction of a heated region, at which the shapes do not touch themselves
SHAPES = {  # Number of the heated spring from base to tip: 2 is drawn right, 0 is none
    "cold": (0, 0, 0, 0),
    "all of spring 2": (2, 2, 2, 2),
    "all of spring 1": (1, 1, 1, 1),
    "base only": (2, 0, 0, 0),
    "tip only": (0, 0, 0, 2),
    "opposite halves": (2, 2, 1, 1),
    "in turns": (2, 1, 2, 1),
    "ends one way, middle the other": (2, 1, 1, 2),
}
DENSITY = 1070.0  # Density of the silicone from its table [kg/m3]


def _phases(heated: tuple[int, ...], level: float = WARM) -> list[tuple[pj.MartensiteFraction, ...]]:
    """Activations of the regions."""
    return [tuple(pj.MartensiteFraction(level if n == k else 1.0) for n in (1, 2)) for k in heated]


def _chain(bench: Bench, *, turned: bool = False, weighed: bool = False) -> pj.SegmentChain:
    """A PneuSMA2 whose springs are heated in regions; turned: every other region by 90 degrees."""

    def build() -> pj.SegmentChain:
        body = pj.make_actuator(
            "pneusma2", bench.alloys["krl35"], bench.silicone, length=LENGTH,
            active_coils=26.0, free_length=7e-3, attached_length=LENGTH,
        )  # fmt: skip
        chain = pj.chain_of(body, REGIONS, angles=[0.5 * np.pi * (turned and k % 2) for k in range(REGIONS)])
        if not weighed:
            return chain
        return chain.with_loads(
            chain_weight(chain.segments, DENSITY, pj.gravity_vector("vertical_base_down"))
        )

    return bench.keep(("regions", turned, weighed), build)


def shape_of(
    bench: Bench, heated: tuple[int, ...], *, turned: bool = False, weighed: bool = False
) -> pj.ChainEquilibrium:
    """The actuator with some regions of its springs heated."""
    return bench.keep(
        ("shape", heated, turned, weighed),
        lambda: jax.tree.map(
            np.asarray,
            pj.solve_chain(_chain(bench, turned=turned, weighed=weighed), PRESSURE, _phases(heated)),
        ),
    )


def _bends(found: pj.ChainEquilibrium) -> np.ndarray:
    """Bend angle of every region [deg]."""
    return np.rad2deg([float(segment.bend_angle) for segment in found.segments])


def _both_ways(bench: Bench) -> Found:
    """Bend with spring 1 heated over that with spring 2 heated [1]."""
    one, two = (_bends(shape_of(bench, SHAPES[f"all of spring {k}"])).sum() for k in (1, 2))
    return Found(float(one / two), f"{one:.1f} and {two:.1f} deg")


def _turns(bench: Bench) -> Found:
    """Number of changes of the sense of bending along the actuator, the maximum over the shapes."""
    each = {}
    for name, heated in SHAPES.items():
        bends = _bends(shape_of(bench, heated))
        signs = np.sign(bends[np.abs(bends) > 1.0])
        each[name] = int(np.sum(signs[1:] != signs[:-1]))
    return Found(float(max(each.values())), "; ".join(f"{n}: {k}" for n, k in each.items()))


def _independent(bench: Bench) -> Found:
    """Largest change of a cold region's bend by heating another, weight included [% of the heated one's]."""
    rest = _bends(shape_of(bench, (0,) * REGIONS, weighed=True))
    shares = []
    for k in range(REGIONS):
        heated = tuple(2 if i == k else 0 for i in range(REGIONS))
        change = _bends(shape_of(bench, heated, weighed=True)) - rest
        others = np.delete(change, k)
        shares.append(100.0 * float(np.abs(others).max() / np.abs(change[k])))
    return Found(max(shares), f"{listed(np.asarray(shares))} % with the region from base to tip heated")


def _one_way(bench: Bench) -> Found:
    """Pressures at which the fibre-reinforced actuator bends the other way than at the highest [%]."""
    path = np.asarray(bench.sweep("pneuflex_s").rows.curvature)
    moving = path[np.abs(path) > 1e-9]
    return Found(100.0 * float(np.mean(np.sign(moving) != np.sign(path[np.argmax(np.abs(path))]))))


def _out_of_plane(bench: Bench) -> Found:
    """Distance of the tip from the plane of the first region, over the actuator's length at rest [%]."""
    tip = np.asarray(shape_of(bench, (2, 2, 1, 2), turned=True).end_pose)[:3, 3]
    return Found(100.0 * abs(float(tip[0])) / (REGIONS * LENGTH), f"tip at {listed(1e3 * tip)} mm")


def _line(axes: Axes, chain: pj.SegmentChain, found: pj.ChainEquilibrium, heated: tuple[int, ...]) -> None:
    shade = ScalarMappable(Normalize(HOT, 1.0), "plasma_r")
    shape = found.shape
    for k, body in enumerate(chain.segments):
        for number, place in zip((1, 2), np.asarray(body.spring_places), strict=True):
            y, z = 1e3 * np.asarray(shape.line(np.asarray(k), place))[:, 1:].T
            axes.plot(-y, z, color=shade.to_rgba(WARM) if heated[k] == number else GREY,
                      linewidth=3.0 if heated[k] == number else 1.4)  # fmt: skip
    y, z = 1e3 * np.asarray(shape.polyline())[:, 1:].T
    axes.plot(-y, z, color=BLACK, linewidth=0.8, linestyle=(0, (4, 3)))


def draw(bench: Bench) -> Figure:
    """Every shape in its plane, heated regions marked."""
    with style():
        figure = Figure(figsize=(11.0, 6.4), layout="constrained")
        panels = figure.subplots(2, len(SHAPES) // 2)
        for axes, (name, heated) in zip(panels.ravel(), SHAPES.items(), strict=True):
            found = shape_of(bench, heated)
            _line(axes, _chain(bench), found, heated)
            axes.set(aspect="equal", xlim=(-125.0, 125.0), ylim=(-60.0, 190.0))
            axes.set_title(f"{name}\n{_bends(found).sum():+.0f} deg in all", fontsize=9)
        for axes in panels[-1]:
            axes.set_xlabel("towards side 2 [mm]")
        for axes in panels[:, 0]:
            axes.set_ylabel("along the straight tube [mm]")
        axes = panels[0, 0]
        axes.plot([], [], color=ScalarMappable(Normalize(HOT, 1.0), "plasma_r").to_rgba(WARM), linewidth=3.0,
                  label=f"heated to xi0 = {WARM:g}")  # fmt: skip
        axes.plot([], [], color=GREY, linewidth=1.4, label="cold spring")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


_WHERE = "Section 3.2.3"
ENTRIES = (
    Entry(
        "3.2", "Shapes from heated regions of the springs", _WHERE, draw,
        f"A PneuSMA2 of {REGIONS} regions of {1e3 * LENGTH:g} mm at {1e-3 * PRESSURE:g} kPa, in the plane "
        "of its springs; the base is at the origin. Each region is a segment of a chain.",
        "The drawn shapes, their pressure and their heat are lost; ours are prescribed.",
        (
            Statement(
                "3.2-1", _WHERE, "it bends in several directions: bend with spring 1 heated over that with "
                "spring 2",
                "1", Interval(-1.01, -0.99, -1.5, -0.5), _both_ways,
            ),
            Statement(
                "3.2-2", _WHERE, "heating regions bends it in several segments: changes of the sense of "
                "bending along it", "1", at_least(2.0, 1.0), _turns,
            ),
            Statement(
                "3.2-3", _WHERE, "segments are controlled independently with one chamber: largest change of "
                "another region's bend, by weight, tip up (of the heated region's)", "%",
                at_most(5.0, 20.0), _independent,
                "a heated region tilts the weight of what it carries",
            ),
            Statement(
                "3.2-4", _WHERE, "a simple fibre-reinforced actuator bends in one direction only: share of "
                "pressures at which it bends the other way", "%", at_most(0.0), _one_way,
            ),
            Statement(
                "3.2-5", _WHERE, "with segments of springs in planes 90 degrees apart it bends in three "
                "dimensions: way of the tip out of the first plane (of the length)", "%",
                at_least(10.0, 2.0), _out_of_plane,
            ),
        ),
    ),
)  # fmt: skip
