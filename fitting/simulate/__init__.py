"""Predictions of the model for recordings and single states: specimens, histories, cautions."""

from fitting.inference.latent_trajectory.denoise import martensite_fraction
from fitting.specimens.cautions import actuator_cautions, silicone_cautions, spring_cautions
from fitting.specimens.model_objects import actuator_of, alloy_of, geometry_of, law_of, spring_of

from .recording import Prediction, predict

__all__ = [
    "Prediction",
    "actuator_cautions",
    "actuator_of",
    "alloy_of",
    "martensite_fraction",
    "geometry_of",
    "law_of",
    "predict",
    "silicone_cautions",
    "spring_cautions",
    "spring_of",
]
