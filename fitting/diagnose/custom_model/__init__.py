"""A base model of one's own: what it misses, from a list of candidate terms, and the model with them.

    >>> def base(values, columns, facts, slot):
    ...     pressure = slot("pressure", columns["pressure"])
    ...     return {"angle": slot("angle", values["compliance"] * facts["area"] * pressure)}
    >>> result = explain_own(OwnModel(base, parameters, terms), recordings)
    >>> result.named

The base is a plain function that JAX can differentiate. It passes numbers through named slots; a `Term` is a
sentence, bounds and a function that acts at one of them. They are treated as `pneusma diagnose` treats its
own models. It refits, scores, fits together and weighs terms, leaves recordings out, and predicts those that
were never fitted.

- `model`: terms, slots, the augmented function; `data`: recordings of one's own, stacked;
- `fits`: least squares, score screen, recordings left out; `search`: which terms enter; `result`: the answer.
"""

from .data import OwnRecording
from .model import OwnModel, Term
from .result import Explained
from .search import explain_own

__all__ = ["Explained", "OwnModel", "OwnRecording", "Term", "explain_own"]
