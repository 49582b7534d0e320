"""Models on disk: a base model with numbers of its own, and effects beyond it (`pneusma-model/1`)."""

from .discrepancy import AddedDiscrepancy
from .files import SCHEMA, load_model, render_model, save_model
from .model import DIAGNOSIS, AddedEffect, AugmentedModel, add_effect, diagnosed_title, fitted

__all__ = [
    "DIAGNOSIS", "SCHEMA", "AddedEffect", "AddedDiscrepancy", "AugmentedModel", "add_effect",
    "diagnosed_title", "fitted", "load_model", "render_model", "save_model",
]  # fmt: skip
