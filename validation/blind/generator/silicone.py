"""Engineering stress of Dragon Skin 10 FAST over strain: Table 3.1, joined at zero without a jump."""

import numpy as np

JOIN = 0.02
LOW, HIGH = -0.54, 1.5
SLOPE_FLOOR = 50e3
TENSION = 1e3 * np.array([-63.4249, 239.8487, -264.5191, 234.7951, 0.0])
COMPRESSION = 1e3 * np.array([9176.3472, 11193.7489, 4470.7769, 822.4502, 0.0])


def _end_slope(coefficients, strain):
    return max(np.polyval(np.polyder(coefficients), strain), SLOPE_FLOOR)


SLOPE_LOW = _end_slope(COMPRESSION, LOW)
SLOPE_HIGH = _end_slope(TENSION, HIGH)


def _quartic(c, x):
    return x * (c[3] + x * (c[2] + x * (c[1] + x * c[0])))


def base_stress(strain):
    """Stress [Pa] of the nominal silicone at an engineering strain [1] of any shape."""
    inside = np.minimum(np.maximum(strain, LOW), HIGH)
    u = np.minimum(np.maximum((inside + JOIN) * (0.5 / JOIN), 0.0), 1.0)
    weight = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
    push = _quartic(COMPRESSION, inside)
    stress = push + weight * (_quartic(TENSION, inside) - push)
    outside = strain - inside
    if np.any(outside):
        stress = stress + np.where(outside > 0, SLOPE_HIGH, SLOPE_LOW) * outside
    return stress
