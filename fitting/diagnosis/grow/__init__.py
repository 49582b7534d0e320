"""The search for effects.

- `stages`: what a search goes through and ends with;
- `choose`, `pruning`, `standings`: which candidate enters, which earlier one is idle or gives way;
- `growing`, `detours`, `explain`: one effect after the other, pairs from rivals of the first, both.
"""
