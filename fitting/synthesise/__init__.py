"""Simulated campaigns with a known truth, labelled as such, for examples, tests and blind cases.

Examples:
    >>> from fitting.synthesise import synthesise
    >>> made = synthesise("spring", seed=1, truth={"beta_1": 21.0})
    >>> made.truth["parameters"]["beta_1"]["value"], made.campaign
"""

from .registry import makers, synthesise, write_synthetic
from .wishes import Synthetic, Wishes

__all__ = ["Synthetic", "Wishes", "makers", "synthesise", "write_synthetic"]
