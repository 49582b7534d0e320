"""Many optimisers of a library side by side, each in its own code, all in one compiled program.

SciPy's optimisers ask for one point after the other. Here each runs in a thread of its own and waits where it
asks. When all wait, their points are evaluated together. The order is that of the workers, so that a run is
the same every time.
"""

import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

Ask = Callable[[np.ndarray], Any]


class _Stopped(BaseException):
    """Ends a worker when another one, or the evaluation, has failed."""


class _Meeting:
    """Meeting point of workers that wait for their answers."""

    def __init__(self, count: int):
        self.ready = threading.Condition()
        self.waiting: dict[int, np.ndarray] = {}
        self.answers: dict[int, Any] = {}
        self.alive = count
        self.error: BaseException | None = None

    def ask(self, worker: int, place: np.ndarray) -> Any:
        """Wait for the evaluation of a place."""
        with self.ready:
            self.waiting[worker] = np.array(place, dtype=float)
            self.ready.notify_all()
            self.ready.wait_for(lambda: worker in self.answers or self.error is not None)
            if self.error is not None:
                raise _Stopped
            return self.answers.pop(worker)

    def leave(self, error: BaseException | None) -> None:
        """A worker is done."""
        with self.ready:
            self.alive -= 1
            self.error = self.error or error
            self.ready.notify_all()


def run_together(
    workers: Sequence[Callable[[Ask], Any]], evaluate: Callable[[list[np.ndarray]], list[Any]]
) -> list[Any]:
    """Results of all workers.

    Args:
        workers: each is called with a function that evaluates a place.
        evaluate: function that evaluates the places of all waiting workers, in the order of the workers.

    Raises:
        Exception: the first that a worker or the evaluation raised.
    """
    meeting = _Meeting(len(workers))
    results: list[Any] = [None] * len(workers)

    def work(k: int) -> None:
        error = None
        try:
            results[k] = workers[k](lambda place: meeting.ask(k, place))
        except _Stopped:
            pass
        except BaseException as raised:  # handed on to the caller
            error = raised
        meeting.leave(error)

    threads = [threading.Thread(target=work, args=(k,), daemon=True) for k in range(len(workers))]
    for thread in threads:
        thread.start()
    try:
        while _answered(meeting, evaluate):
            pass
    except BaseException as error:
        with meeting.ready:
            meeting.error = error
            meeting.ready.notify_all()
        raise
    finally:
        for thread in threads:
            thread.join()
    if meeting.error is not None:
        raise meeting.error
    return results


def _answered(meeting: _Meeting, evaluate: Callable) -> bool:
    """Answer everybody who waits once all who live do; False when nobody lives."""
    with meeting.ready:
        meeting.ready.wait_for(lambda: meeting.error is not None or len(meeting.waiting) == meeting.alive)
        if meeting.error is not None or meeting.alive == 0:
            return False
        order = sorted(meeting.waiting)
        places = [meeting.waiting.pop(k) for k in order]
    answers = evaluate(places)
    with meeting.ready:
        meeting.answers.update(zip(order, answers, strict=True))
        meeting.ready.notify_all()
    return True
