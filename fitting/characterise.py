"""Characterise campaigns of recordings: the documented entry.

Its results are data of `fitting.calibrate` that also report, save and sample themselves.

>>> from fitting.characterise import characterise
>>> fit = characterise("campaign_folder")
>>> print(fit.report())
>>> fit.save("results")
"""

import fitting.report.results  # noqa: F401  says how results look
import fitting.sample.campaign  # noqa: F401  says how results are sampled
from fitting.calibrate import Characterisation, Estimate, characterise
from fitting.calibrate.batch import Batch, characterise_batch

__all__ = ["Batch", "Characterisation", "Estimate", "characterise", "characterise_batch"]
