"""A chain of segments in space: a figure of one configuration, and a short animation of a history.

The tube is a translucent surface swept along the centre line. Each spring is a line on its wall, coloured by
its martensite fraction. A strain-limiting fibre is a black line, the clamped base a black ring. One actuator
is drawn as a chain of one.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
from matplotlib import colormaps
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator
from mpl_toolkits.mplot3d import Axes3D

from pneusma_jax.errors import InputError
from pneusma_jax.numerics.safe import as_numpy
from pneusma_jax.section import Section
from pneusma_jax.serial_chain.segments import ChainEquilibrium, ChainHistory, SegmentChain
from pneusma_jax.serial_chain.shape import ChainShape
from pneusma_jax.units import from_si

from . import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, legend_above, style

HEAT = ListedColormap(
    colormaps["plasma"](np.linspace(0.82, 0.0, 256))
)  # hot orange to cold blue, no pale end
PHASES = ScalarMappable(Normalize(0.0, 1.0), HEAT)
CURVES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
LEAST_ASPECT = 0.6  # Minimum aspect ratio of the drawn box; labels of a thinner one overlap
POINTS, SPOKES = 25, 25  # Numbers of points along a segment and around the tube
FRAMES, FRAMES_PER_SECOND, PIXELS_PER_INCH = 40, 10, 80


@dataclass
class _Segment:
    """Lines of one segment [mm], shape (rows, lines, points, 3); the wall has one line per spoke."""

    wall: np.ndarray
    springs: np.ndarray
    fibres: np.ndarray
    phases: np.ndarray  # martensite fraction, shape (rows, springs)


@dataclass
class _Scene:
    """All lines to draw, over rows; coordinates in mm."""

    segments: list[_Segment]
    centre: np.ndarray

    @property
    def box(self) -> np.ndarray:
        """Lower and upper corner of a box that contains all rows and has a minimum thickness, shape (2,
        3)."""
        points = np.concatenate([part.wall.reshape(-1, 3) for part in self.segments])
        low, high = points.min(axis=0), points.max(axis=0)
        half = 0.5 * np.maximum(high - low, LEAST_ASPECT * np.max(high - low))
        return 0.5 * (low + high) + half * np.array([[-1.0], [1.0]])


def chain_figure(chain: SegmentChain, found: ChainEquilibrium, title: str = "") -> Figure:
    """The chain in one configuration.

    Args:
        chain: chain with the positions of springs and fibres.
        found: solved configuration; see `serial_chain.solve.solve_chain`.
        title: title above the figure.

    Raises:
        InputError: if a segment found no equilibrium.
    """
    if not np.all(np.isfinite(found.end_pose)):
        raise InputError("the chain cannot be drawn: one of its segments found no equilibrium")
    phases = [np.asarray([[float(s.xi0) for s in segment.springs]]) for segment in found.segments]
    scene = _scene(chain, jax.tree.map(lambda leaf: leaf[None], found.shape), phases)
    with style():
        figure = Figure(figsize=(7.2, 6.4), layout="constrained")
        axes = figure.add_subplot(projection="3d")
        _draw(axes, scene, 0)
        _frame_box(axes, scene.box)
        axes.set_title(title)
        if any(part.phases.size for part in scene.segments):
            figure.colorbar(
                PHASES, ax=axes, shrink=0.6, pad=0.1, label="martensite fraction of the spring [1]"
            )
    return figure


def animation(
    chain: SegmentChain,
    history: ChainHistory,
    pressure: np.ndarray,
    time: np.ndarray | None = None,
    frames: int = FRAMES,
) -> bytes:
    """A GIF of a history: the chain in space above, martensite fractions and pressure below.

    Args:
        chain: chain with the positions of springs and fibres.
        history: history from `serial_chain.solve.simulate_chain_history`.
        pressure: gauge pressure [Pa], shape (rows,).
        time: time [s], shape (rows,); rows are counted if None.
        frames: number of rows to show, evenly spaced; 40 take about half a megabyte.

    Raises:
        InputError: if no row was solved.
    """
    good = np.flatnonzero(np.asarray(history.converged))
    if good.size == 0:
        raise InputError("there is nothing to animate: no row of the history found an equilibrium")
    shown = good[np.unique(np.linspace(0, good.size - 1, frames).round().astype(int))]
    rows = history.shape.lengths.shape[0]
    phases = [np.asarray([s.xi0 for s in part.rows.springs]).reshape(-1, rows).T for part in history.segments]
    scene = _scene(chain, jax.tree.map(lambda leaf: leaf[shown], history.shape), [p[shown] for p in phases])
    x, label = (np.arange(len(pressure)), "row") if time is None else (np.asarray(time), "time [s]")
    with style(), tempfile.TemporaryDirectory() as folder:
        figure = Figure(figsize=(6.4, 7.6))
        above = figure.add_axes((0.0, 0.335, 0.86, 0.66), projection="3d")
        below = figure.add_axes((0.13, 0.07, 0.73, 0.15))
        if any(p.size for p in phases):
            bar = figure.add_axes((0.87, 0.46, 0.025, 0.42))
            figure.colorbar(PHASES, cax=bar, label="martensite fraction [1]")
        _course(below, chain, x, pressure, phases)
        below.set_xlabel(label)
        marker = below.axvline(x[shown[0]], color=BLACK, linewidth=1.5)
        draft = Path(folder) / "animation.gif"
        writer = PillowWriter(fps=FRAMES_PER_SECOND)
        with writer.saving(figure, draft, PIXELS_PER_INCH):
            for frame, row in enumerate(shown):
                above.clear()
                _draw(above, scene, frame, width=2.2)
                _frame_box(above, scene.box)
                marker.set_xdata([x[row]] * 2)
                writer.grab_frame()
        return draft.read_bytes()


def section_outline(section: Section) -> np.ndarray:
    """Points on the section's outer line, a closed polygon [m], shape (n, 2).

    There is one on each of `SPOKES` rays from the centre line, and one at each corner. Where a ray meets no
    wall, the point lies at the distance of the sides.
    """
    corners = np.asarray(getattr(section.shapes[0], "vertices", np.zeros((0, 2))))
    turns = np.arctan2(corners[:, 1], corners[:, 0]) % (2.0 * np.pi)
    angles = np.union1d(np.linspace(0.0, 2.0 * np.pi, SPOKES), turns)
    spokes = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    plain = as_numpy(section)
    reach = np.asarray([float(plain.boundary(spoke)) for spoke in spokes])
    return np.where(np.isfinite(reach), reach, float(plain.radius))[:, None] * spokes


def _scene(chain: SegmentChain, shape: ChainShape, phases: list[np.ndarray]) -> _Scene:
    """Lines of a shape over rows."""
    mm = lambda points: from_si(np.asarray(points), "mm")  # noqa: E731
    parts = []
    for k, (body, fractions) in enumerate(zip(chain.segments, phases, strict=True)):
        fibre = np.zeros((0, 2)) if body.fibre_place is None else np.asarray(body.fibre_place)[None]
        springs = np.asarray(body.spring_places).reshape(-1, 2)
        outline = section_outline(body.section)
        places = np.concatenate([outline, springs, fibre])
        lines = mm(jax.vmap(lambda place, k=k: shape.line(k, place, POINTS), out_axes=1)(places))
        wall, springs, fibres = np.split(lines, [len(outline), len(outline) + len(springs)], axis=1)
        parts.append(_Segment(wall, springs, fibres, fractions))
    return _Scene(parts, mm(shape.polyline(POINTS)))


def _draw(axes: Axes3D, scene: _Scene, row: int, width: float = 3.2) -> None:
    """Tube, springs (of a width in points), fibres and centre line in one row."""
    for part in scene.segments:
        wall = part.wall[row]
        axes.plot_surface(*np.moveaxis(wall, -1, 0), color=GREY, alpha=0.18, linewidth=0)
        for end in (0, -1):
            axes.plot(*wall[:, end].T, color=GREY, linewidth=1.0)
        for line, phase in zip(part.springs[row], part.phases[row], strict=True):
            axes.plot(*line.T, color=HEAT(float(phase)), linewidth=width)
        for line in part.fibres[row]:
            axes.plot(*line.T, color=BLACK, linewidth=1.8)
    axes.plot(*scene.segments[0].wall[row][:, 0].T, color=BLACK, linewidth=2.2)
    axes.plot(*scene.centre[row].T, color=BLACK, linewidth=0.9, linestyle=(0, (4, 3)))


def _frame_box(axes: Axes3D, box: np.ndarray) -> None:
    """Equal scales and equal steps of the ticks on all axes, labels with units."""
    size = box[1] - box[0]
    ticks = MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, float(size.max()))
    for name, (low, high) in zip("xyz", box.T, strict=True):
        axis = getattr(axes, f"{name}axis")
        getattr(axes, f"set_{name}lim")(low, high)
        axis.set_label_text(f"{name} [mm]")
        axis.set_major_locator(MultipleLocator(ticks[1] - ticks[0]))
    axes.set_box_aspect(size)
    axes.view_init(elev=22.0, azim=-55.0)


def _course(
    axes: Axes, chain: SegmentChain, x: np.ndarray, pressure: np.ndarray, phases: list[np.ndarray]
) -> None:
    """Pressure and, of the springs that are driven, the martensite fraction over the history."""
    driven = [
        (f"segment {k}, spring {number}", fraction)
        for k, (body, fractions) in enumerate(zip(chain.segments, phases, strict=True), 1)
        for number, fraction in zip(body.spring_numbers, fractions.T, strict=True)
        if np.ptp(fraction) > 0.0
    ]
    few = len(driven) <= len(CURVES)
    for k, (label, fraction) in enumerate(driven):
        axes.plot(x, fraction, color=CURVES[k] if few else GREY, label=label if few else None, linewidth=1.4)
    axes.set(ylabel="martensite\nfraction [1]", ylim=(-0.03, 1.03), xlim=(x[0], x[-1]))
    other = axes.twinx()
    other.grid(visible=False)
    other.plot(x, from_si(np.asarray(pressure), "kPa"), color=BLACK, linestyle="--", linewidth=1.2)
    other.set_ylabel("pressure [kPa]")
    other.spines["right"].set_visible(True)
    axes.plot([], [], color=BLACK, linestyle="--", linewidth=1.2, label="pressure")  # its legend entry
    legend_above(axes, columns=2 if len(driven) < 4 else 3)
