"""Everything that is summed up of a part of a study, merged, and stored as arrays."""

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from .correlation import Correlation
from .failures import Failures
from .indices import Sums
from .moments import Moments, Sketches
from .touching import Touching


@dataclass(frozen=True)
class Summary:
    """Sums of rows.

    Attributes:
        moments, sketches: statistics of every column, over the independent rows with a result.
        correlation: correlation of inputs and columns.
        beyond: rows that have failed a limit, by its words, up to each point, shape (points,).
        failures: counts over all rows.
        indices: sums over blocks; None if no indices are requested.
        touching: rows in which the body may touch itself, of all rows.
    """

    moments: Moments
    sketches: Sketches
    correlation: Correlation
    beyond: Mapping[str, np.ndarray]
    failures: Failures
    indices: Sums | None = None
    touching: Touching = Touching.of()

    def merge(self, other: "Summary") -> "Summary":
        """Sums of both parts. The order of parts decides rounding and sketches, so it is always the same."""
        return Summary(
            self.moments.merge(other.moments),
            self.sketches.merge(other.sketches),
            self.correlation.merge(other.correlation),
            {words: count + other.beyond[words] for words, count in self.beyond.items()},
            self.failures.merge(other.failures),
            None if self.indices is None else self.indices.merge(other.indices),
            self.touching.merge(other.touching),
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """All sums by name."""
        found: dict[str, np.ndarray] = {}
        for name in ("moments", "correlation", "failures", "indices", "touching"):
            part = getattr(self, name)
            if part is not None:
                found |= {
                    f"{name}/{field.name}": np.asarray(getattr(part, field.name))
                    for field in dataclasses.fields(part) if field.name != "kind"
                }  # fmt: skip
        if self.indices is not None:
            found["indices/kind"] = np.frombuffer(self.indices.kind.encode(), np.uint8)
        whole = b"".join(self.sketches.digests)
        found["sketches/bytes"] = np.frombuffer(whole, np.uint8)
        found["sketches/sizes"] = np.asarray([len(digest) for digest in self.sketches.digests])
        for k, (words, count) in enumerate(self.beyond.items()):
            found[f"beyond/{k}/words"] = np.frombuffer(words.encode(), np.uint8)
            found[f"beyond/{k}/count"] = count
        return found

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "Summary":
        """The inverse of `arrays`."""

        def part(name: str, kind: type) -> object:
            fields = {
                f.name: arrays[f"{name}/{f.name}"] for f in dataclasses.fields(kind) if f.name != "kind"
            }
            for number in ("count", "blocks", "left_out"):
                if number in fields and np.ndim(fields[number]) == 0:
                    fields[number] = fields[number].item()
            return fields

        ends = np.cumsum([0, *arrays["sketches/sizes"]])
        whole = arrays["sketches/bytes"].tobytes()
        beyond, k = {}, 0
        while f"beyond/{k}/words" in arrays:
            beyond[arrays[f"beyond/{k}/words"].tobytes().decode()] = arrays[f"beyond/{k}/count"]
            k += 1
        indices = None
        if "indices/kind" in arrays:
            indices = Sums(kind=arrays["indices/kind"].tobytes().decode(), **part("indices", Sums))
        return cls(
            Moments(**part("moments", Moments)),
            Sketches(tuple(whole[a:b] for a, b in zip(ends[:-1], ends[1:], strict=True))),
            Correlation(**part("correlation", Correlation)),
            beyond,
            Failures(**part("failures", Failures)),
            indices,
            Touching(**part("touching", Touching)),
        )


def merge_all(parts: Iterable[Summary]) -> Summary:
    """All parts in their order, neighbours first, like a tree.

    A sketch loses a little with each merge; so each part goes through as many as its number has binary
    digits. Few summaries are held at a time, however many there are.

    Raises:
        ValueError: if there are none.
    """
    waiting: list[tuple[int, Summary]] = []
    for part in parts:
        height = 0
        while waiting and waiting[-1][0] == height:
            part, height = waiting.pop()[1].merge(part), height + 1
        waiting.append((height, part))
    if not waiting:
        raise ValueError("Argument `parts` must have at least one summary, but it is empty.")
    whole = waiting.pop()[1]
    while waiting:
        whole = waiting.pop()[1].merge(whole)
    return whole
