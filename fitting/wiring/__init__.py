"""Many springs on one pair of wires, selected by band-pass filters (Fig. 3.26). See docs/wiring.md."""

from .choose import Bounds, Springs, Wiring, choose_filters, most_springs
from .circuit import Circuit, crosstalk, heating

__all__ = [
    "Bounds", "Circuit", "Springs", "Wiring", "choose_filters", "crosstalk", "heating", "most_springs",
]  # fmt: skip
