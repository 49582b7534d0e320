"""Staged pipelines that turn a campaign into a characterised material, one for each kind of specimen.

Many specimens together are `fitting.calibrate.batch`. It draws samples, whose libraries take half a second to
load, so it is not loaded here.

>>> from fitting.characterise import characterise
>>> fit = characterise("campaign_folder")
>>> print(fit.report())
>>> fit.save("results")
"""

from .registry import characterise
from .result import Characterisation, Estimate

__all__ = ["Characterisation", "Estimate", "characterise"]
