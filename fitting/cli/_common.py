"""Shared parts of the commands: getting ready to compute, results on disk, words on the terminal."""

import math
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

DESIGNS = ("pneusma1", "pneusma2", "pneuflex_s", "pneuflex_t", "pneuflex_w", "triad")


class FiniteNumber(type(click.FLOAT)):  # type: ignore[misc]
    """A finite number; `nan` and `inf` are none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number; the error of an option names it."""
        found = super().convert(value, param, ctx)
        if not math.isfinite(found):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return found


class Finite(FiniteNumber, click.FloatRange):
    """A finite number within limits."""


FINITE = FiniteNumber()
SEED = click.IntRange(0)
COUNT = click.IntRange(1)


def prepare() -> None:
    """Float64 and the compilation cache, before any model is built."""
    from pneusma_jax import enable_float64

    enable_float64()


def notice(text: str) -> None:
    """Say something beside the result, on stderr."""
    click.echo(f"note: {' '.join(text.split())}", err=True)


def model_of(path: Path | None, *chosen: Mapping[str, str | None]) -> Any:
    """The model that `--model` names, or the base model; says what it adds, see `tell_model`."""
    from fitting.specimens.model_objects import BASE
    from fitting.specimens.saved_models import load_model

    model = BASE if path is None else load_model(path)
    tell_model(model, *chosen)
    return model


def tell_model(model: Any, *chosen: Mapping[str, str | None]) -> None:
    """Say what a model on disk adds, and which of its tables others replace, each once.

    Args:
        model: `AugmentedModel`.
        chosen: tables of every calculation with it; see `AugmentedModel.remarks`.
    """
    for sentence in dict.fromkeys(said for one in chosen for said in model.remarks(one)):
        notice(sentence)


def tell_unused(options: Mapping[str, str], why: str) -> None:
    """Say of options that were given, and that have nothing to act on.

    Args:
        options: how they are written, by the name of their value.
        why: what there is not.
    """
    context = click.get_current_context()
    for name, option in options.items():
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            notice(f"{option} has no effect: {why}")


def done(paths: Sequence[Path]) -> None:
    """Tell where the results are."""
    for path in paths:
        click.echo(f"wrote {path}")


def table_argument(given: str) -> str:
    """Name or path of a table as the command line means it: a path counts from the working folder."""
    is_path = given.endswith(".toml") or "/" in given or "\\" in given
    return str(Path(given).resolve()) if is_path else given


def design_argument(given: str) -> str:
    """Name or path of an actuator or a chain as the command line means it.

    Raises:
        click.UsageError: if it is neither a known name nor the path of a TOML file; names the nearest.
    """
    if given.endswith(".toml"):
        return table_argument(given)
    from importlib import resources

    names = []
    for folder in (("examples", "designs"), ("examples", "chains")):
        entries = resources.files("calibration_data").joinpath(*folder).iterdir()
        names += sorted(e.name.removesuffix(".toml") for e in entries if e.name.endswith(".toml"))
    if given not in (known := (*DESIGNS, *names)):
        from pneusma_jax.errors import nearest

        raise click.UsageError(f"--design {given!r} is not known, {nearest(given, known)}")
    return given


def check_places(workers: int | None, address: str | None) -> None:
    """Refuse two places for tasks.

    Raises:
        click.UsageError: if both are given.
    """
    if workers is not None and address is not None:
        raise click.UsageError("--workers starts a cluster here, and --cluster names one; give one of them")


def scheduler(workers: int | None, address: str | None) -> AbstractContextManager[Any]:
    """Scheduler of the engine's tasks, for a `with` statement.

    Args:
        workers: processes to start on this machine, or None.
        address: address of a running Dask scheduler, or None.

    Raises:
        click.UsageError: if both are given.
        InputError: if Dask is not installed, or no scheduler answers.
    """
    check_places(workers, address)
    if workers is None and address is None:
        from fitting.engine import in_this_process

        return nullcontext(in_this_process)
    from fitting.engine.place import place_of  # imports Dask

    return place_of(workers, address)
