"""The blind trial of `pneusma diagnose`: sealed campaigns, reports, then the truth and the score.

    python -m validation.blind.proof run --plan fixed --seed 20261121 --baselines

The modules, in the order of their use, are `places` (files of a run), `run` (seal and diagnose), `worker`
(one case), `baselines` (other methods on the same case), `judge` (one report against its truth), `score`
(rates with intervals), `ledger` (every scoring run, and the table), `figures`.
"""
