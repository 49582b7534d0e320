"""The search for effects.

- `steps`: steps of a search and their result;
- `choose`, `backward_elimination`, `leave_one_out_evidence`: which candidate enters, which earlier effect is
  redundant or gives way;
- `stepwise`, `pair_search`, `explain`: one effect after the other, pairs from rivals of the first, both.
"""
