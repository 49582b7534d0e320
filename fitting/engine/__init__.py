"""Many independent tasks, each a file of its own: what is missing is computed, here or on other machines.

A task is known by its name and computed from its number alone. Its file is written under another name and
then renamed, so a file that is there is whole. A run that was ended in any way goes on with the tasks whose
files are missing, and leaves the same bytes.
"""

from .folders import digest, unique_names
from .progress import Rate
from .results import run_results
from .run import Scheduler, in_this_process, run_tasks
from .store import Store, Task

__all__ = [
    "Rate", "Scheduler", "Store", "Task", "digest", "in_this_process", "run_results", "run_tasks",
    "unique_names",
]  # fmt: skip
