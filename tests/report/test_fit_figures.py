"""Figures of a fit: rows and model are both seen, residuals have one sign, no constant is left out."""

import io
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from fitting.calibrate.general.scores import Score
from fitting.calibrate.quoted import estimates
from fitting.inference.metrics import metrics
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report import characterisation
from fitting.report.diagnosis import figures as diagnosis
from fitting.report.figures import BLACK, VERMILION, png, recording_figure, style
from fitting.report.general import figures as general
from fitting.report.posterior import figures as posterior
from fitting.report.spring import figures as spring

REPORT = Path(general.__file__).parents[1]
ALIKE = 0.08
"""Maximum distance of a colour from that of a mark, of 1, to be counted as this mark's; smoothed edges lie further."""
SEEN = 150
"""Minimum number of pixels by which marks are seen. A line of 300 by 2 pixels has 600."""


def curve(count):
    x = np.linspace(0.0, 60.0, count)
    return x, 0.05 * x + 0.3 * np.sin(x / 8.0)


def score_of(count, off=0.0):
    x, y = curve(count)
    return Score("a", "fit", "force_N", "elongation_mm", x, y + off, y, 1.0)


def of_recording(axes, count):
    from fitting.report.figures import _compared

    x, y = curve(count)
    _compared(axes, "elongation_mm", x, y, y)


def of_spring(axes, count):
    x, y = curve(count)
    spring._stress(axes, SimpleNamespace(gamma=x, stress=y, predicted=y))


def of_posterior(axes, count):
    x, y = curve(count)
    one = SimpleNamespace(x=x, measured=y, sigma=np.full(count, 1e-6), recording="a", role="fit", x_column="strain", y_column="stress_kPa")
    posterior._bands(axes, Figure().subplots(), one, np.tile(y, (20, 1)))


DRAWN = {"general": lambda axes, count: general._compared(axes, score_of(count)), "recording": of_recording, "spring": of_spring, "posterior": of_posterior}


def luminance(colour):
    """Relative luminance of sRGB, as contrast on paper is judged by."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


@pytest.mark.parametrize("count", [10, 200, 10_000])
@pytest.mark.parametrize("kind", DRAWN)
def test_measured_rows_and_the_model_are_both_seen_where_they_agree(kind, count):
    """Lines hid the rows of a good fit: dots of 3 points lay below lines of 1.2."""
    with style():
        figure = Figure(figsize=(3.5, 2.9))
        axes = figure.subplots()
        DRAWN[kind](axes, count)
        axes.axis("off")
        if axes.get_legend():
            axes.get_legend().remove()
        image = imread(io.BytesIO(png(figure)))[:, :, :3]
    for colour in (BLACK, VERMILION):
        alike = np.abs(image - to_rgb(colour)).max(axis=2) < ALIKE
        assert alike.sum() > SEEN, colour


def test_rows_and_models_differ_in_lightness_as_print_shows_it():
    brightness = {name: luminance(colour) + 0.05 for name, colour in {"rows": BLACK, "model": VERMILION, "paper": "#ffffff"}.items()}
    assert brightness["model"] / brightness["rows"] > 3.0  # contrast that WCAG 2.1 asks of graphical objects
    assert brightness["paper"] / brightness["model"] > 3.0


def test_residuals_are_measured_less_model_in_every_figure():
    """That of a diagnosis was model less measured, and no axis told."""
    x, y = curve(30)
    with style():
        axes = {name: Figure().subplots() for name in ("general", "diagnosis", "posterior")}
        general._left(axes["general"], score_of(30, 0.5))
        channel = SimpleNamespace(measured=y + 0.5, sigma=np.full(30, 0.1))
        program = SimpleNamespace(channels=[[channel]], stacked=SimpleNamespace(time=[x]))
        base = SimpleNamespace(evaluation=SimpleNamespace(predicted=[[y]]))
        conclusion = SimpleNamespace(explanation=SimpleNamespace(program=program, base=base), changed=False)
        diagnosis._residuals(conclusion, 0, 0, axes["diagnosis"])
        one = SimpleNamespace(x=x, measured=y + 0.5, sigma=np.full(30, 0.1), recording="a", role="fit", x_column="strain", y_column="stress_kPa")
        posterior._bands(Figure().subplots(), axes["posterior"], one, np.tile(y, (20, 1)))
        below = recording_figure("a", ("strain", x), {"stress_kPa": (y + 0.5, y)}, {}).axes[1]
    for drawn in (*axes.values(), below):
        assert "measured - model" in drawn.get_ylabel()
        rows = [line.get_ydata() for line in drawn.lines if len(line.get_ydata()) == 30]
        assert len(rows) == 1 and np.all(np.asarray(rows[0]) > 0.0)


def test_no_axis_of_a_residual_is_labelled_otherwise():
    said = re.compile(r"set_ylabel\([^)\n]*(?:residual|difference|miss|recording -|fitted stress)")
    assert said.search('axes.set_ylabel("residual / noise [1]")')
    assert not [str(path) for path in sorted(REPORT.rglob("*.py")) if said.search(re.sub(r"residual_(?:label|over_noise)\(", "", path.read_text()))]


def test_the_signed_difference_of_tables_has_the_same_sign_and_tells_it():
    assert metrics(np.array([2.0, 3.0]), np.array([1.0, 2.0]))["rpd_signed"] > 0.0
    assert "measured - model" in characterisation.SIGNED and "positive where the model is low" in characterisation.SIGNED
    for module in ("general", "spring"):
        text = (REPORT / module / "report.py").read_text()
        assert '"signed %"' in text and "SIGNED" in text


@pytest.fixture
def characterised():
    """A result of constants inside, at either bound, and with flat priors."""
    found = Parameters()
    found.add(Parameter("inside", 10.3, prior=Prior(10.0, 1.0), standard_error=0.4))
    found.add(Parameter("upper", 14.0, max=14.0, prior=Prior(10.0, 1.0)))
    found.add(Parameter("lower", 1e-3, min=1e-3, prior=Prior(2e-3, 5e-4)))
    found.add(Parameter("flat", 0.3, min=0.0, max=1.0, standard_error=0.05))
    found.add(Parameter("flat_at_bound", 1.0, min=0.0, max=1.0))
    found.add(Parameter("nowhere", 1.0, standard_error=0.1))
    return SimpleNamespace(fitted=found, parameters=estimates(found, {}))


def test_a_constant_at_its_bound_is_drawn_as_an_arrow_that_points_beyond_it(characterised):
    """Constants without a prior were left out, and those at a bound looked like any other."""
    with style():
        figure = general._parameters(characterised)
    (axes,) = figure.axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["inside", "upper", "lower", "flat", "flat_at_bound"]
    arrows = {(line.get_marker(), float(line.get_ydata()[0])): float(line.get_xdata()[0]) for line in axes.lines if line.get_marker() in "<>"}
    assert arrows == {(">", 1.0): pytest.approx(4.0), ("<", 2.0): pytest.approx(-2.0), (">", 4.0): pytest.approx(np.sqrt(3.0))}
    dots = [float(line.get_ydata()[0]) for line in axes.lines if line.get_marker() == "o"]
    assert dots == [0.0, 3.0]
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert "stopped at its bound" in said and "prior" in said and "flat prior, bound to bound" in said
    caption = general._parameters_caption(characterised)
    assert "An arrow marks a constant that stopped at its bound" in caption and caption.endswith("compare with: nowhere.")


def test_the_legend_of_constants_names_no_bound_where_none_was_reached(characterised):
    for name in ("upper", "lower", "flat", "flat_at_bound", "nowhere"):
        del characterised.fitted._entries[name]
    with style():
        (legend,) = general._parameters(characterised).legends
    assert [text.get_text() for text in legend.get_texts()] == ["prior", "found, with its standard error"]
    assert "arrow" not in general._parameters_caption(characterised) and "Not drawn" not in general._parameters_caption(characterised)
