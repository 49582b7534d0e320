"""Conclusions of a search.

- `locate`: drivers and rows of a misfit;
- `discrepancy_places`, `discrepancy_evidence`, `discrepancy`: smooth model discrepancies, as rivals of named
  effects and as a description of what has no name;
- `held_out`, `probabilities`, `unexplained`: held-out scores, probabilities, judgement of the remaining
  misfit;
- `accept`: removal of effects that predict worse;
- `next_experiment`: the next experiment;
- `conclusion`, `text`, `conclude`: the verdict as data, as text, and how it is reached.
"""
