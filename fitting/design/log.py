"""Every evaluation of a study, in a file that only grows: a killed study goes on from it.

A line of the file holds what was evaluated together. A continued search runs again from its beginning, but
evaluations in the file are not computed again. So the result is the same, to the last byte. A line that a
kill cut short is dropped.
"""

import contextlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneusma_jax.errors import InputError

from .program import Model

SCHEMA = "pneusma-evaluations/2"


@dataclass(frozen=True)
class Evaluation:
    """Values at one place in the box.

    Attributes:
        place: shape (parameters,).
        values: objectives and constraints, shape (numbers,).
        jacobian: derivatives by the place, shape (numbers, parameters).
    """

    place: np.ndarray
    values: np.ndarray
    jacobian: np.ndarray

    @property
    def finite(self) -> bool:
        """True if all of it could be computed."""
        return bool(np.all(np.isfinite(self.values)) and np.all(np.isfinite(self.jacobian)))


class Log:
    """Evaluations on disk.

    Args:
        path: path of the file; None keeps the evaluations in memory alone.
        fingerprint: fingerprint of the study; a file of another study is refused.

    Raises:
        InputError: if the file belongs to another study, or cannot be used.
    """

    def __init__(self, path: Path | None, fingerprint: str):
        self.path = path
        self.known: dict[tuple[int, bytes], Evaluation] = {}
        self.reused = 0
        self._made: list[Path] = []
        if path is None:
            return
        head = json.dumps({"schema": SCHEMA, "fingerprint": fingerprint}) + "\n"
        try:
            self._made = [folder for folder in path.parents if not folder.exists()]
            path.parent.mkdir(parents=True, exist_ok=True)
            content = path.read_bytes() if path.exists() else b""
            whole = content[: content.rfind(b"\n") + 1]
            if whole and whole.split(b"\n", 1)[0] + b"\n" != head.encode():
                raise InputError(
                    f"{path}: these are evaluations of another study, or of other tables; choose "
                    "another folder, "
                    "or start over with --force"
                )
            with open(path, "wb" if not whole else "r+b") as file:
                file.write(b"" if whole else head.encode())
                file.truncate(len(whole) or len(head))
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror})") from None
        for line in whole.splitlines()[1:]:
            self._remember(json.loads(line))
        self.reused = len(self.known)

    def discard(self) -> None:
        """Remove the file, and the folders that were made for it: a study that is refused leaves nothing.

        Evaluations of an earlier run stay: they may have taken hours.
        """
        if self.path is None or self.reused:
            return
        with contextlib.suppress(OSError):  # such as a folder that holds something else by now
            self.path.unlink()
            for folder in self._made:
                folder.rmdir()

    def _remember(self, entry: dict) -> None:
        rows = zip(entry["places"], entry["values"], entry["jacobians"], strict=True)
        for place, values, jacobian in rows:
            shape = (len(values), len(place))
            one = Evaluation(
                *(np.array(x, dtype=float) for x in (place, values)), np.array(jacobian, float).reshape(shape)
            )
            self.known[entry["choice"], one.place.tobytes()] = one

    def add(self, choice: int, places: np.ndarray, values: np.ndarray, jacobians: np.ndarray) -> None:
        """Keep what was evaluated together."""
        entry = {
            "choice": choice, "places": places.tolist(), "values": values.tolist(),
            "jacobians": jacobians.tolist(),
        }  # fmt: skip
        if self.path is not None:
            with open(self.path, "ab") as file:
                file.write((json.dumps(entry) + "\n").encode())
        self._remember(entry)


class LoggedModel:
    """A model whose evaluations are kept.

    Args:
        model: model to be evaluated.
        log: log that keeps the evaluations.
        choice: number of the model's combination of choices.
        size: number of places that go through the program at once.
        said: called after every lot.

    Attributes:
        asked: number of places that were asked for.
        seen: what was asked for, in order. Evaluations of a former run count once they are asked for again;
            so a study that goes on does the same.
    """

    def __init__(self, model: Model, log: Log, choice: int, size: int, said: object = lambda: None):
        self.model, self.log, self.choice, self.size, self.said = model, log, choice, size, said
        self.asked = 0
        self.seen: dict[bytes, Evaluation] = {}

    @property
    def equilibria(self) -> int:
        """Equilibria solved for this model in all, those of former runs included."""
        count = sum(choice == self.choice for choice, _ in self.log.known)
        return count * len(self.model.states.names) * self.model.draws.count

    def __call__(self, places: list[np.ndarray]) -> list[Evaluation]:
        """Evaluations of places, in order; those that are known are not computed again."""
        keys = [(self.choice, np.asarray(place, dtype=float).tobytes()) for place in places]
        new = list(dict.fromkeys(key for key in keys if key not in self.log.known))
        if new:
            wanted = np.stack([np.frombuffer(key[1]) for key in new])
            lots = [wanted[k : k + self.size] for k in range(0, len(wanted), self.size)]
            found = [self._computed(lot) for lot in lots]
            self.log.add(self.choice, wanted, *(np.concatenate(x) for x in zip(*found, strict=True)))
        self.asked += len(places)
        self.seen.update((key[1], self.log.known[key]) for key in keys)
        self.said()
        return [self.log.known[key] for key in keys]

    def _computed(self, lot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.model.evaluate(lot, self.size)
