"""Trajectories that are not measured but must explain what is: smoothers and their Gauss-Newton steps."""
