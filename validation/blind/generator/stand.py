"""Simulation and base prediction of each kind."""

from . import actuator, coil, tube, wire

TRUTH = {"elastomer": tube.elastomer_truth, "tube": tube.tube_truth, "spring": coil.spring_truth,
         "wire": wire.wire_truth, "actuator": actuator.actuator_truth}  # fmt: skip
BASE = {"elastomer": tube.elastomer_base, "tube": tube.tube_base, "spring": coil.spring_base,
        "wire": wire.wire_base, "actuator": actuator.actuator_base}  # fmt: skip
FORWARD = {"spring": coil.spring_forward, "actuator": actuator.actuator_forward}


def truth(bench, numbers, effects=()):
    """Noise-free columns of a specimen with its concealed physics, (B, K, N) each."""
    return TRUTH[bench.kind](bench, numbers, effects)


def base(bench, numbers, recorded):
    """Noise-free predictions of the published model from noise-free recorded inputs."""
    return BASE[bench.kind](bench, numbers, recorded)


def forward(bench, numbers, recorded, course, watched=False):
    """Noise-free predictions from noise-free recorded inputs and latent fractions (B, K, N). Second, by row
    (K, N), the earlier row that the metal remembers. With `watched` the last set but one shares the first
    one's memory."""
    return FORWARD[bench.kind](bench, numbers, recorded, course, watched)
