"""`pneusma diagnose`: where recordings and model disagree, what physics was left out, and the model with it.

    >>> conclusion = diagnose(read_campaign("campaign"), seed=1)
    >>> conclusion.found[0].slug
    'wrap_friction'

Packages; each imports those above it only:

- `settings`: every threshold, with its meaning and the measurement that it rests on;
- `evaluate`: a campaign that can be evaluated anywhere;
- `fit`: models fitted to it, and what they are worth;
- `search`: the search for effects;
- `verdict`: what it means: places, probabilities, proof, verdict, next experiment.

`check` says what `run` may be given and what cannot be tested; `run` goes through all of them. The layer
`report` puts a `Conclusion` on paper.
"""

from .run import diagnose
from .verdict.conclusion import Conclusion

__all__ = ["Conclusion", "diagnose"]
