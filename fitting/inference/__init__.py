"""Inference that every fit uses: parameters, least squares, noise, latent trajectories, cached programs."""
