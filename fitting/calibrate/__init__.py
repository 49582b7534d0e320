"""Staged pipelines that turn a campaign into a characterised material, one for each kind of specimen.

>>> from fitting.characterise import characterise
>>> fit = characterise("campaign_folder")
>>> print(fit.report())
>>> fit.save("results")
"""

from .batch import Batch, characterise_batch
from .registry import characterise
from .result import Characterisation, Estimate

__all__ = ["Batch", "Characterisation", "Estimate", "characterise", "characterise_batch"]
