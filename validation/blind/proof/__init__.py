"""The blind trial of `pneusma diagnose`: sealed campaigns, reports, then the truth and the score.

    python -m validation.blind.proof run --plan fixed --seed 20261121 --baselines

The modules in the order of their use: `places` has the files of a run, `run` seals and diagnoses, and
`worker` does one case. `baselines` are other methods on the same case. `judge` holds one report against its
truth, `score` gives rates with intervals. `ledger` has every scoring run and the table, `figures` the
figures.
"""
