"""Models fitted to a campaign, and their evidence.

- `refit`: least squares of base constants and effects within physical bounds;
- `misfit`, `evidence`: chi-square of recordings, log Bayes factors;
- `campaign_noise`, `outliers`, `base_fit`: noise about a base model, outliers, the base model fitted with
  both;
- `score_test`, `candidates`: scores of all effects against chance, candidate fits;
- `cross_validation`, `instrument_drift`, `input_noise_evidence`: cross-validation, and the evidence that
  drift and noise of inputs explain.
"""
