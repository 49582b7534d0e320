"""The former name of `fitting.specimens.saved_models`, for programs that were written for it."""

from fitting.specimens.saved_models import AugmentedModel, add_effect, load_model, save_model

__all__ = ["AugmentedModel", "add_effect", "load_model", "save_model"]
