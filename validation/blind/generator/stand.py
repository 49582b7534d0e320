"""Simulation and base prediction of each kind."""

from collections.abc import Callable
from dataclasses import dataclass

from . import actuator, coil, tube, wire


@dataclass(frozen=True)
class Stand:
    """Simulations of one kind; see the functions below for their arguments."""

    truth: Callable
    base: Callable
    forward: Callable | None = None


STANDS = {
    "elastomer": Stand(tube.elastomer_truth, tube.elastomer_base),
    "tube": Stand(tube.tube_truth, tube.tube_base),
    "spring": Stand(coil.spring_truth, coil.spring_base, coil.spring_forward),
    "wire": Stand(wire.wire_truth, wire.wire_base),
    "actuator": Stand(actuator.actuator_truth, actuator.actuator_base, actuator.actuator_forward),
}
"""The one table of simulations by kind; the generator shares none with `fitting`."""


def truth(bench, numbers, effects=()):
    """Noise-free columns of a specimen with its concealed physics, (B, K, N) each."""
    return STANDS[bench.kind].truth(bench, numbers, effects)


def base(bench, numbers, recorded):
    """Noise-free predictions of the published model from noise-free recorded inputs."""
    return STANDS[bench.kind].base(bench, numbers, recorded)


def forward(bench, numbers, recorded, course, watched=False):
    """Noise-free predictions from noise-free recorded inputs and latent fractions (B, K, N). Second, by row
    (K, N), the earlier row that the metal remembers. With `watched` the last set but one shares the first
    one's memory."""
    return STANDS[bench.kind].forward(bench, numbers, recorded, course, watched)
