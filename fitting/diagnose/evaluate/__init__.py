"""A campaign that can be evaluated anywhere.

- `unknowns`: scaled numbers of base model and effects;
- `noise`, `high_frequency_noise`, `inputs`, `instruments`: measured channels and their noise, that of
  measured inputs, too;
- `compiled`, `program`, `evaluation`: one compiled function for everything (its laws are in
  `fitting.specimens`), a campaign, what its runs say;
- `latent_trajectories`, `trajectory_search`: latent trajectories, and how an evaluation finds them.
"""
