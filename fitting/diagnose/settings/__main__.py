"""Print the table of thresholds; with a file as argument, bring the table of that document up to date."""

import sys
from pathlib import Path

from . import DEFAULT
from .table import rewrite, table

if __name__ == "__main__":
    if len(sys.argv) > 1:
        rewrite(Path(sys.argv[1]), DEFAULT)
    else:
        print(table(DEFAULT))
