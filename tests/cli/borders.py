"""Faults of pictures: ink that touches a border, text beyond it, axes without a quantity or a unit."""

import re
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from PIL import Image

INK = 40
"""Minimum of difference from the background, of 255, that counts as ink: soft edges of letters are fainter."""

BAND = 3
"""Width of the border that must be free [pixels]: less than figures leave, more than most gaps between letters."""


def cut_at(file: Path) -> list[str]:
    """Borders of a picture at which something is cut off; the background is the colour of its corners."""
    pixels = np.asarray(Image.open(file).convert("RGB"), dtype=int)
    background = np.median([pixels[0, 0], pixels[0, -1], pixels[-1, 0], pixels[-1, -1]], axis=0)
    rings = {
        "top": pixels[:BAND], "bottom": pixels[-BAND:], "left": pixels[:, :BAND], "right": pixels[:, -BAND:],
    }  # fmt: skip
    return [name for name, ring in rings.items() if np.abs(ring - background).max() > INK]


def cut_pictures(folder: Path) -> dict[str, list[str]]:
    """Pictures below a folder that are cut at a border, with the borders."""
    found = {str(file.relative_to(folder)): cut_at(file) for file in sorted(folder.rglob("*.png"))}
    return {name: borders for name, borders in found.items() if borders}


UNIT = re.compile(r"\[[^\]]+\]( |$)")
"""A unit in brackets at the end of a label, or before a remark."""
WITHOUT_UNIT = re.compile(r"^(step|(?:heated|selected) spring|input or group|iteration)\b")
"""Labels of counts and of names."""
WITHOUT_QUANTITY = re.compile(r"^[xyz] \[")
"""Labels that name a coordinate, and not the quantity whose coordinate it is."""


def faults(figure: Figure) -> list[str]:
    """Labels without a quantity or a unit in brackets, and texts or legends that reach beyond the picture."""
    canvas, frame, found = FigureCanvasAgg(figure), figure.bbox.padded(1.0), []
    canvas.draw()
    renderer, ticks = canvas.get_renderer(), {id(label) for label in _ticks(figure)}
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            label = axis.get_label().get_text().replace("\n", " ").strip()
            if label and not UNIT.search(label) and not WITHOUT_UNIT.match(label):
                found.append(f"no unit: {label}")
            if WITHOUT_QUANTITY.match(label) and not hasattr(axes, "zaxis"):  # in space the title names it
                found.append(f"no quantity: {label}")
    for artist in figure.findobj(lambda artist: isinstance(artist, Text | Legend)):
        if isinstance(artist, Text) and not artist.get_text().strip():
            continue
        if not artist.get_visible() or (artist.axes is not None and not artist.axes.get_visible()):
            continue
        if id(artist) in ticks:
            continue
        box = artist.get_window_extent(renderer)
        if not (frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1)):
            words = artist.get_text() if isinstance(artist, Text) else "legend"
            found.append(f"beyond the picture: {words!r}")
    return found


def _ticks(figure: Figure) -> list[Text]:
    """Texts of ticks: those outside an axis's range are kept and not drawn, so only ink tells of them."""
    axes = [axis for one in figure.axes for axis in (one.xaxis, one.yaxis, getattr(one, "zaxis", None)) if axis]
    ticks = [tick for axis in axes for tick in (*axis.majorTicks, *axis.minorTicks)]
    return [label for tick in ticks for label in (tick.label1, tick.label2)]
