"""A campaign that can be evaluated at any numbers.

- `unknowns`: scaled numbers of base model and effects;
- `noise`, `high_frequency_noise`, `inputs`, `instruments`: measured channels, their noise and that of inputs;
- `compiled`, `program`, `evaluation`: one compiled function, a campaign, results of its runs;
- `latent_trajectories`, `process_noise`: latent trajectories as random walks, and their variances;
- `variable_projection`, `trajectory_search`: their linear problem, and how an evaluation finds them.
"""
