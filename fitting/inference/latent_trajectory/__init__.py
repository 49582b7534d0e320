"""Latent trajectories, which are not measured but must explain the measurements: smoothers and their
Gauss-Newton steps."""
