"""Segments in series: their kinematics, shape in space and clearance."""
