"""The search for effects: one search over sets of effects.

- `steps`: scores, candidates and the explanation that a search ends with;
- `pool`: fitted sets of effects;
- `set_search`: the beam that proposes, fits and extends sets;
- `decision`: which set is named: evidence, left-out recordings, instruments;
- `explain`: the whole search of a campaign.
"""
