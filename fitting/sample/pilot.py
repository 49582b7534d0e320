"""Which sampler a posterior gets: a short pilot, before anything long is run."""

from .laplace import Laplace
from .settings import Settings
from .target import Target


def pilot(target: Target, found: Laplace, settings: Settings) -> tuple[str, str]:
    return "emcee", "emcee."
