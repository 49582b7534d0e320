"""Many simulated campaigns as tasks of the engine: each a file in a folder, here or on workers, with resume.

A campaign is known by its seed. `pneusma propagate`, `characterise-batch` and the blind trial run through the
same engine. What a kill leaves is whole, and the next run computes what is missing.
"""

import itertools
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.engine import Rate, Store, Task, run_tasks
from fitting.engine.place import place_of
from pneusma_jax import enable_float64


@dataclass(frozen=True)
class CampaignJob:
    """One campaign by its number.

    Attributes:
        campaign: from a seed to what is kept of it, a dictionary that JSON can hold; picklable.
        seeds: of all campaigns.
    """

    campaign: Callable[[int], dict]
    seeds: tuple[int, ...]

    def __call__(self, number: int) -> bytes:
        enable_float64()
        return (json.dumps(self.campaign(self.seeds[number])) + "\n").encode()


def add_arguments(parser, campaigns: int) -> None:
    """Options that every benchmark of many campaigns has."""
    parser.add_argument("--campaigns", type=int, default=campaigns)
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no campaign after these")
    parser.add_argument("--dir", type=Path, help="folder with a file for each campaign")
    parser.add_argument("--file", type=Path, help="results of an earlier run, one a line; they count, too")
    parser.add_argument("--workers", type=int, help="processes to start here; needs the extra cluster")
    parser.add_argument("--report", action="store_true", help="only report what is there")


def campaigns_done(
    campaign: Callable[[int], dict], seeds: Sequence[int], given, usual: str
) -> tuple[list[dict], int, float]:
    """Compute the campaigns that are missing.

    Args:
        campaign: see `CampaignJob`.
        seeds: of all campaigns.
        given: options of `add_arguments`.
        usual: name of the folder where none is given.

    Returns:
        What is kept of all campaigns that are there, how many are new, and the seconds that these took.
    """
    earlier = [json.loads(line) for line in given.file.read_text().splitlines()] if given.file else []
    known = {entry["seed"] for entry in earlier}
    seeds = tuple(seed for seed in seeds if seed not in known)
    tasks, store = [Task(f"{seed}.json") for seed in seeds], Store(given.dir or Path(usual))
    began, before, new = time.monotonic(), len(tasks) - len(store.missing(tasks)), 0
    if not given.report:
        with place_of(given.workers) as place, Rate("campaigns", len(tasks), before, "campaigns") as shown:

            def in_time(job, numbers):
                more = lambda _: time.monotonic() - began < 60.0 * given.minutes  # noqa: E731
                return place(job, itertools.takewhile(more, numbers))

            new = run_tasks(CampaignJob(campaign, seeds), tasks, store, in_time, shown)
    spent, missing = time.monotonic() - began, set(store.missing(tasks))
    there = [json.loads(store.read(task)) for number, task in enumerate(tasks) if number not in missing]
    return earlier + there, new, spent
