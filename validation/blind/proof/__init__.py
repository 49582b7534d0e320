"""The blind trial of `pneusma diagnose`: sealed campaigns, reports, then the truth, and what that makes.

    python -m validation.blind.proof run --plan fixed --seed 20261121 --baselines

Rooms, in the order in which they are used: `places` (files of a run), `run` (seal and diagnose), `worker` (one
case), `baselines` (other methods on the same case), `judge` (one report against its truth), `score` (rates with
intervals), `ledger` (every scoring run, and the table), `figures`.
"""
