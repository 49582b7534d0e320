"""What a search means.

- `locate`: drivers and rows of a misfit;
- `places`, `generic`, `remainder`: nameless corrections, to race against and for what is unmodelled;
- `prove`, `probabilities`, `judged`: held-out scores, what is how likely, how what is left is judged;
- `accept`: effects that predict worse what was not fitted are taken back;
- `designs`: the next experiment;
- `words`, `conclude`: the verdict.
"""
