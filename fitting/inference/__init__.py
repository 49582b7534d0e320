"""What every fit stands on: parameters, least squares, noise, latent trajectories, cached programs."""
