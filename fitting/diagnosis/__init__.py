"""`pneusma diagnose`: where recordings and model disagree, what physics was left out, and the model with it.

    >>> conclusion = diagnose(read_campaign("campaign"), seed=1)
    >>> conclusion.found[0].slug
    'wrap_friction'

Rooms, in the order in which they are used:

- `kinds/`: how the rows of each kind become outputs, with every effect of the catalogue in one program;
- `unknowns`, `noise`, `program`: scaled numbers, whitened channels, one compiled program for everything;
- `refit`: least squares of base constants and effects within physical bounds;
- `screen`: score tests of all effects against chance over all of them;
- `explain`: co-refits, evidence, one effect after the other;
- `locate`, `prove`, `conclude`: drivers and rows, held-out scores, probabilities;
- `words`, `document`, `figures`, `page`: the report.
"""

from .conclude import Conclusion
from .run import diagnose

__all__ = ["Conclusion", "diagnose"]
