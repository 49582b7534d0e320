"""`pneusma diagnose`: where recordings and model disagree, what physics was left out, and the model with it.

    >>> conclusion = diagnose(read_campaign("campaign"), seed=1)
    >>> conclusion.found[0].slug
    'wrap_friction'

Rooms, in the order in which they are used:

- `unknowns`, `noise`, `quiet`, `inputs`, `instruments`, `campaign_noise`: scaled numbers, whitened channels;
- `compiled`, `program`, `evaluation`, `courses`, `search`: one compiled function for everything (its laws are
  in `fitting.models.with_effects`), a campaign, what its runs say once hidden courses are found;
- `refit`: least squares of base constants and effects within physical bounds;
- `misfit`, `evidence`, `settled`: what a fit leaves of recordings, log Bayes factors, the base model and the
  noise about it;
- `screen`, `trials`, `folds`: scores of all effects against chance, co-refits, recordings left out in turn;
- `choose`, `pruning`, `standings`, `growing`, `detours`, `explain`, `stages`: which candidate enters, which
  earlier one is idle or gives way, one effect after the other, pairs from rivals of the first, both; what a
  search went through;
- `places`, `generic`, `remainder`: nameless corrections, to race against and for what is unmodelled;
- `locate`, `prove`, `probabilities`, `judged`, `conclude`, `designs`: drivers and rows, held-out scores, how
  what is left is judged, the verdict, the next experiment;
- `check`: what `run` may be given, and what cannot be tested;
- `words`, `document`, `figures`, `page`: the report.
"""

from .conclude import Conclusion
from .run import diagnose

__all__ = ["Conclusion", "diagnose"]
