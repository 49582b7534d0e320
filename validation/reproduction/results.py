"""What a reproduction found, as data."""

from collections import Counter
from dataclasses import dataclass

from matplotlib.figure import Figure

from fitting.inference.results import Result

from .entry import Entry
from .expectation import Verdict
from .statement import Judged


@dataclass(frozen=True)
class Reproduction(Result):
    """The statements of the source with our numbers and verdicts, and our figures.

    Attributes:
        entries: the figures that were considered, in the source's order.
        judged: of every statement, in the same order.
        figures: our drawings by number of the source's figure.
    """

    entries: tuple[Entry, ...]
    judged: tuple[Judged, ...]
    figures: dict[str, Figure]

    def about(self, entry: Entry) -> list[Judged]:
        """What was found on the statements of one figure."""
        return [j for j in self.judged if j.statement in entry.statements]

    def counts(self, stated: bool = True) -> dict[Verdict, int]:
        """How many statements got each verdict.

        Args:
            stated: count the source's own statements, or the expectations that we add.
        """
        found = Counter(j.verdict for j in self.judged if j.statement.stated is stated)
        return {verdict: found[verdict] for verdict in Verdict}
