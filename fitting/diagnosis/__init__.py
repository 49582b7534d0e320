"""`pneusma diagnose`: where recordings and model disagree, what physics was left out, and the model with it.

    >>> conclusion = diagnose(read_campaign("campaign"), seed=1)
    >>> conclusion.found[0].slug
    'wrap_friction'

Rooms; each imports those above it only, and says in its own words what it holds:

- `evaluate`: a campaign that can be evaluated anywhere;
- `fit`: models fitted to it, and what they are worth;
- `grow`: the search for effects;
- `judge`: what it means: places, probabilities, proof, verdict, next experiment;
- `report`: all of that on paper.

`check` says what `run` may be given and what cannot be tested; `run` goes through all but the last.
"""

from .judge.conclude import Conclusion
from .run import diagnose

__all__ = ["Conclusion", "diagnose"]
