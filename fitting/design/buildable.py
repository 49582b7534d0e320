"""Ends of ranges at which nothing can be made, such as a wall that leaves no bore."""

import itertools
from collections.abc import Sequence

import numpy as np

from pneusma_jax.errors import InputError

from .bodies import Plan, build_body
from .space import Space

MOST_CORNERS = 64
"""Maximum of combinations of the other parameters' ends that are tried for an end."""


def check_ends(space: Space, drives: Sequence[str], plans: Sequence[Plan], path: str) -> None:
    """Refuse an end of a range at which no design can be made, wherever the other parameters are.

    Args:
        space: box of the free parameters.
        drives: names of those that are drives of states and no dimensions.
        plans: plans of every combination of choices; an end is refused if none of them can be made there.
        path: path of the file, for messages.

    Raises:
        InputError: naming the parameter, its end and what is impossible.
    """
    sizes = [k for k, one in enumerate(space.free) if one.name not in drives]
    for end in (0.0, 1.0):  # where both these corners can be made, no end is impossible
        if _impossible(space, plans, np.full(len(space), end)):
            break
    else:
        return
    for k in sizes:
        others = [j for j in sizes if j != k]
        for end, word in ((0.0, "lower"), (1.0, "upper")):
            reason = _everywhere(space, plans, k, end, others)
            if reason:
                one = space.free[k]
                raise InputError(
                    f"{path}: [free] {one.name}: nothing can be made at the {word} end of its range: {reason}"
                )


def _everywhere(space: Space, plans: Sequence[Plan], k: int, end: float, others: list[int]) -> str:
    """Reason why nothing can be made at an end of a parameter, by the last corner; empty if something can."""
    reason = ""
    for corner in itertools.islice(itertools.product((0.0, 1.0, 0.5), repeat=len(others)), MOST_CORNERS):
        place = np.full(len(space), 0.5)
        place[others], place[k] = corner, end
        reason = _impossible(space, plans, place)
        if not reason:
            return ""
    return reason


def _impossible(space: Space, plans: Sequence[Plan], place: np.ndarray) -> str:
    """Reason why no plan can be made at a place in the box; empty if one can."""
    sizes = {name: float(x) for name, x in space.parameters(place).items()}
    reason = ""
    for plan in plans:
        try:
            build_body(plan, sizes, plan.materials())
        except ValueError as error:
            reason = str(error).removeprefix("Argument ").rstrip(".")
        else:
            return ""
    return reason
