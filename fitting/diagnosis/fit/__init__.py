"""Models fitted to a campaign, and what they are worth.

- `refit`: least squares of base constants and effects within physical bounds;
- `misfit`, `evidence`: what a fit leaves of recordings, log Bayes factors;
- `campaign_noise`, `apart`, `settled`: the noise about a base model, readings that are not counted, the base
  model settled with both;
- `screen`, `trials`: scores of all effects against chance, co-refits;
- `folds`, `drift`, `averaging`: recordings left out in turn; what instruments explain of an effect.
"""
