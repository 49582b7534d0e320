"""The search for effects.

- `steps`: what a search goes through and ends with;
- `choose`, `backward_elimination`, `leave_one_out_evidence`: which candidate enters, which earlier one is
  idle or gives way;
- `stepwise`, `pair_search`, `explain`: one effect after the other, pairs from rivals of the first, both.
"""
