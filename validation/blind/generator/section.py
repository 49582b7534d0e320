"""The tube's cross-section as a full disc less the disc of its bore.

Each disc is summed by the midpoint rule in the angle whose sine is the height. The integrand continues
periodically, so the rule converges fast. The points are fixed in the section, so that a fibre of silicone can
keep its history. Points of the bore count negatively, with the history that silicone there would have.
"""

import numpy as np

AROUND = 56


class Annulus:
    """Points `height` [m above side 2] and `area` [m2] of shape (..., points), bore area and bore centre.

    `bore` = (shift, flat). The first is the shift of the bore's centre towards side 1, as a share of the
    wall. The second is its flattening, the relative change of its two half axes. Zero is the concentric
    circle.
    """

    def __init__(self, q, *, around=AROUND, bore=(0.0, 0.0)):
        outer = 0.5e-3 * q["outer_diameter_mm"]
        wall = 1e-3 * q["wall_thickness_mm"]
        inner = outer - wall
        angle = np.pi / around * (np.arange(around) + 0.5) - 0.5 * np.pi
        rule = 2.0 * np.pi / around * np.cos(angle) ** 2
        shift, flat = bore
        high, wide = inner * (1.0 - flat), inner * (1.0 + flat)
        centre = outer + shift * wall
        full = outer[..., None] * (1.0 + np.sin(angle)), outer[..., None] ** 2 * rule
        hole = centre[..., None] + high[..., None] * np.sin(angle), (high * wide)[..., None] * rule
        points = np.broadcast_arrays(full[0], full[1], hole[0], hole[1])
        self.height = np.concatenate([points[0], points[2]], axis=-1)
        self.area = np.concatenate([points[1], -points[3]], axis=-1)
        self.diameter = 2.0 * outer
        self.bore_area = np.pi * high * wide
        self.bore_height = centre
