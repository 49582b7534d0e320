"""The result of a reproduction, as data."""

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
        entries: considered figures, in the source's order.
        judged: judgement of every statement, in the same order.
        figures: our drawings by number of the source's figure.
    """

    entries: tuple[Entry, ...]
    judged: tuple[Judged, ...]
    figures: dict[str, Figure]

    def about(self, entry: Entry) -> list[Judged]:
        """Judged statements about one figure."""
        return [j for j in self.judged if j.statement in entry.statements]

    def counts(self, stated: bool = True) -> dict[Verdict, int]:
        """Number of statements with each verdict.

        Args:
            stated: true to count the source's own statements, false for the expectations that we add.
        """
        found = Counter(j.verdict for j in self.judged if j.statement.stated is stated)
        return {verdict: found[verdict] for verdict in Verdict}
