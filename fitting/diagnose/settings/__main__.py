"""Print the tables of thresholds; with a file as argument, bring those of that document up to date."""

import sys
from pathlib import Path

from . import CATEGORIES, DEFAULT
from .table import rewrite, table

if __name__ == "__main__":
    if len(sys.argv) > 1:
        rewrite(Path(sys.argv[1]), DEFAULT, CATEGORIES)
    else:
        print(table(DEFAULT, CATEGORIES))
