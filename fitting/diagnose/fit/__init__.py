"""Models fitted to a campaign, and what they are worth.

- `refit`: least squares of base constants and effects within physical bounds;
- `misfit`, `evidence`: what a fit leaves of recordings, log Bayes factors;
- `campaign_noise`, `outliers`, `base_fit`: the noise about a base model, readings that are not counted, the
  base model settled with both;
- `score_test`, `candidates`: scores of all effects against chance, co-refits;
- `cross_validation`, `instrument_drift`, `input_noise_evidence`: recordings left out in turn; what
  instruments explain of an effect.
"""
