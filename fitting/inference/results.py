"""The interface of every result.

A result is data. The layer `report` registers its presentation, the layer `sample` its sampler; a result
delegates to both. So a layer that computes never imports one that shows.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting.data.publish import publish

if TYPE_CHECKING:  # matplotlib takes a third of a second to load
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Presenter:
    """Presentation of results of one type. Every function takes the result.

    Attributes:
        verdict: function to the few most important sentences.
        text: function to the whole result as plain text.
        figures: function to the figures by name.
        documents: function to the content of every file, by file name.
    """

    verdict: Callable[[Any], list[str]]
    text: Callable[[Any], str]
    figures: Callable[[Any], dict[str, "Figure"]]
    documents: Callable[[Any], dict[str, str | bytes]]


_PRESENTERS: dict[type | str, Presenter] = {}
_SAMPLERS: dict[type | str, Callable[..., Any]] = {}


def register_presenter(kind: type | str, presenter: Presenter) -> None:
    """Register the presentation of results of a type, or of the type at `module:name`, imported or not."""
    _PRESENTERS[kind] = presenter


def register_sampler(kind: type | str, sampler: Callable[..., Any]) -> None:
    """Register the sampler for the posterior of results of a type: `sampler(result, **options)`.

    The type may be given as `module:name`, as for `register_presenter`.
    """
    _SAMPLERS[kind] = sampler


def sampler_of(result: "Result") -> Callable[..., Any]:
    """Sampler for the posterior of a result.

    Raises:
        RuntimeError: if the layer that knows was never imported.
    """
    return _registered(_SAMPLERS, result, "fitting.sample.campaign")


def _registered(table: dict[type | str, Any], result: "Result", layer: str) -> Any:
    for kind in type(result).__mro__:
        for key in (kind, f"{kind.__module__}:{kind.__qualname__}"):
            if key in table:
                return table[key]
    raise RuntimeError(f"{type(result).__name__}: import {layer} first, or use fitting.characterise")


class Result:
    """Computed data, with a thin facade over the presentation and the sampler in other layers.

    Every method raises RuntimeError if the responsible layer was never imported; `fitting.characterise`
    imports both.
    """

    @property
    def verdict(self) -> list[str]:
        """The findings in a few sentences, the most important first."""
        return self._presenter.verdict(self)

    def report(self) -> str:
        """The whole result as plain text."""
        return self._presenter.text(self)

    def plot(self) -> "dict[str, Figure]":
        """Figures by name; nothing is fitted or drawn on a screen."""
        return self._presenter.figures(self)

    def documents(self) -> dict[str, str | bytes]:
        """Content of every file of the result, by file name."""
        return self._presenter.documents(self)

    def save(self, folder: str | Path, force: bool = False) -> list[Path]:
        """Write all files; in a new folder they appear together or not at all.

        A folder with a `report.json` holds results already. Other files of the folder stay, except those that
        have the name of a new file: these are replaced.

        Args:
            folder: folder for the files, made if it does not exist.
            force: true to replace results that the folder holds already.

        Returns:
            Paths of the files.

        Raises:
            InputError: if the folder holds results already, or the place cannot be written.
        """
        return publish(folder, self.documents, force)

    @property
    def _presenter(self) -> Presenter:
        return _registered(_PRESENTERS, self, "fitting.report.results")
