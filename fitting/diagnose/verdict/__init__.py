"""What a search means.

- `locate`: drivers and rows of a misfit;
- `discrepancy_places`, `discrepancy_evidence`, `discrepancy`: nameless corrections, to race against and for
  what is unmodelled;
- `held_out`, `probabilities`, `unexplained`: held-out scores, what is how likely, how what is left is judged;
- `accept`: effects that predict worse what was not fitted are taken back;
- `next_experiment`: the next experiment;
- `conclusion`, `text`, `conclude`: the verdict as data, in words, and how it is reached.
"""
