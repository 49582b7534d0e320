"""Ink that touches the border of a picture: text or a line that was cut off."""

from pathlib import Path

import numpy as np
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
