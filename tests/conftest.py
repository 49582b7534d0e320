"""Float64 for every test, data that is not part of the repository, a limit on compiled code."""

import gc
import os
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax.monitoring
import pytest
from matplotlib.figure import Figure

from fitting.data.recordings import recordings_folder
from fitting.engine.memory import make_room
from pneusma_jax.precision import enable_float64

enable_float64()
gc.set_threshold(200_000, 20, 50)  # tracing makes many objects and few cycles
MOST_GIB = max(1.9, os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30 / 8)
"""Maximum memory of a process that tests, between modules [GiB]. What is dropped is traced again, and to drop it takes
three seconds. With 2.9 GiB, on a machine of 23, one process did so four times in all tests, with 1.9 ten times."""
ROOT = Path(__file__).resolve().parents[1]
BLANK = bytes.fromhex(
    "89504e470d0a1a0a0000000d494844520000000100000001080000000"
    "03a7e9b550000000a49444154789c63f80f0001010100b138f6140000000049454e44ae426082"
)  # a PNG of one pixel


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder beside the checkout with check values and recordings of other laboratories."""
    folder = Path(os.environ.get("PNEUSMA_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}: set PNEUSMA_SHARED to run the comparison with independent values")
    return folder


@pytest.fixture
def contact_model(tmp_path: Path) -> Callable[..., Path]:
    """Write a model on disk whose tip touches the base past 1 rad: `contact_model(design, stiffness, numbers)`."""

    def write(design: str, stiffness: float, numbers: str = "") -> Path:
        stated = 'status = "fitted", source = "here"'
        path = tmp_path / "mine.toml"
        path.write_text(
            f'schema = "pneusma-model/1"\nname = "mine"\n[base]\ndesign = "{design}"\n{numbers}\n'
            f'[[effect]]\nslug = "tip_contact"\n[effect.parameters]\n'
            f'stiffness = {{value = {stiffness}, unit = "N m/rad", {stated}}}\n'
            f'angle = {{value = 1.0, unit = "rad", {stated}}}\n'
            f'exponent = {{value = 1.5, unit = "1", {stated}}}\n',
            encoding="utf-8",
        )
        return path

    return write


@pytest.fixture
def compiled() -> Iterator[list[str]]:
    """Names of the programs that are compiled or loaded while a test runs."""
    names: list[str] = []

    def seen(event: str, seconds: float, **known: str) -> None:
        if event.endswith("backend_compile_duration"):
            names.append(known.get("fun_name", "?"))

    jax.monitoring.register_event_duration_secs_listener(seen)
    yield names
    jax.monitoring.unregister_event_duration_listener(seen)


@pytest.fixture
def measured() -> Callable[[str], Path]:
    """Finds a raw file of the measured recordings, or skips."""

    def find(name: str) -> Path:
        folder = recordings_folder()
        if folder is None or not (folder / name).exists():
            pytest.skip(f"measured recordings are not here: {name} (PNEUSMA_RECORDINGS, or ../shared/recordings)")
        return folder / name

    return find


@pytest.fixture(autouse=True, scope="module")
def bounded_programs() -> Iterator[None]:
    """Drop compiled programs between modules before they crowd the process out of memory maps."""
    yield
    make_room(MOST_GIB)


@pytest.fixture(autouse=True, scope="session")
def drawn_once(request: pytest.FixtureRequest) -> Iterator[list[bool]]:
    """A figure that was drawn as SVG for a page is not drawn again as PNG, but by the long tests.

    Drawing takes most of the time of a report, and every figure of a report is both. The list is empty while
    this holds.
    """
    drawn: weakref.WeakSet[Figure] = weakref.WeakSet()
    draw, twice = Figure.savefig, [True] if request.config.getoption("-m") != "not slow" else []

    def once(figure: Figure, target: Any, *given: Any, **named: Any) -> None:
        if named.get("format") == "png" and figure in drawn and not twice:
            target.write(BLANK)
            return
        draw(figure, target, *given, **named)
        if named.get("format") == "svg":
            drawn.add(figure)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", once)
        yield twice


@pytest.fixture(scope="module")
def every_png(drawn_once: list[bool]) -> Iterator[None]:
    """Figures of this module are drawn as PNG, too."""
    drawn_once.append(True)
    yield
    drawn_once.pop()
