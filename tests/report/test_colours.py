"""Every colour of a figure is one of the house's palette, which colour-blind readers tell apart, or a grey."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PALETTE = ROOT / "fitting" / "report" / "figures" / "__init__.py"
COLOUR = re.compile(r'"#([0-9a-fA-F]{6})"')
TINT = 40
"""Maximum difference between red, green and blue, of 255, that still looks grey."""
NAMED = re.compile(r"""["'](?:tab:\w+|C\d|red|green|blue|orange|purple|brown|pink|jet|rainbow|hsv|RdYlGn\w*|Spectral\w*)["']""")


def colours(text: str) -> list[str]:
    """Colours in a source that have a hue of their own."""
    parts = [tuple(int(found[k : k + 2], 16) for k in (0, 2, 4)) for found in COLOUR.findall(text)]
    hues = [found for found, part in zip(COLOUR.findall(text), parts, strict=True) if max(part) - min(part) > TINT]
    return hues + NAMED.findall(text)


def test_no_figure_has_a_colour_of_its_own():
    assert colours('a = "#16a34a", "#8a8f98"; b = "tab:blue"') == ["16a34a", '"tab:blue"']
    found = {}
    for package in ("fitting/report", "validation"):
        for path in sorted((ROOT / package).rglob("*.py")):
            if path != PALETTE and "matplotlib" in path.read_text() and (said := colours(path.read_text())):
                found[str(path.relative_to(ROOT))] = said
    assert not found
