"""Errors of a joint fit that span other fits which are nearly as good."""

from dataclasses import replace

import numpy as np

from fitting.calibrate.profile_likelihood import ALIKE

from .joint import Joint, cost_of


def spanned(joint: Joint) -> Joint:
    """The same fit with errors that span the other fits which are nearly as good.

    With other turning points in the memory other constants fit as well. The curvature about one of them knows
    nothing of the others. Every fit gets the probability that its chi-square implies, in units of
    `chi_square_unit`, and the second moment about the best one is added. That is nothing if all starts end at
    one place.

    Args:
        joint: joint fit with all its starts.
    """
    best = joint.result
    names = best.uncertainty.names
    if not names or len(joint.starts) < 2:
        return joint
    least, unit = min(cost_of(start.result) for start in joint.starts), chi_square_unit(joint)
    centre = np.array([joint.starts[0].result.values[n] for n in names])
    more, total = np.zeros((len(names), len(names))), 0.0
    for start in joint.starts:
        weight = float(np.exp(-0.5 * (cost_of(start.result) - least) / unit))
        away = np.array([start.result.values[n] for n in names]) - centre
        more, total = more + weight * np.outer(away, away), total + weight
    covariance = best.uncertainty.covariance + more / total
    sd = np.sqrt(np.diag(covariance))
    parameters, errors = best.parameters.copy(), dict(best.uncertainty.standard_errors)
    for name, error in zip(names, map(float, sd), strict=True):
        parameters[name].set(standard_error=error)
        errors[name] = error
    wider = replace(
        best.uncertainty,
        standard_errors=errors,
        covariance=covariance,
        correlation=covariance / np.outer(sd, sd),
    )
    return replace(joint, result=replace(best, parameters=parameters, uncertainty=wider))


def lead(joint: Joint) -> float:
    """Chi-square by which the best fit is better than all others; 0 where another start ended there."""
    costs = sorted(cost_of(start.result) for start in joint.starts)
    return costs[1] - costs[0] if len(costs) > 1 and costs[1] - costs[0] > ALIKE else 0.0


def chi_square_unit(joint: Joint) -> float:
    """Chi-square for the noise as stated that counts as 1 between fits: the noise's inflation squared.

    If no other start ends at the best fit, nobody knows that it is the best. Then it is at least the best
    fit's lead over the next.
    """
    return max(joint.inflation**2, lead(joint))
