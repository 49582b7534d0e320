"""A campaign that can be evaluated anywhere.

- `unknowns`: scaled numbers of base model and effects;
- `noise`, `quiet`, `inputs`, `instruments`: measured channels and their noise, that of measured inputs, too;
- `compiled`, `program`, `evaluation`: one compiled function for everything (its laws are in
  `fitting.models.with_effects`), a campaign, what its runs say;
- `courses`, `course_search`: hidden courses, and how an evaluation finds them;
- `side_by_side`: threads, and what was counted.
"""
