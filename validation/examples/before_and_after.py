"""The first figure of the README: a held-out pull before and after the diagnosis of `make demo`.

python -m validation.examples.before_and_after docs/figures/before_and_after.png
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.report.figures import BLUE, GREY, VERMILION, measured_marks, residual_over_noise, style
from pneusma_jax import enable_float64

CAMPAIGN = Path(__file__).resolve().parents[2] / "calibration_data" / "examples" / "pulled_silicone"
HELD_OUT = "pull_4"


def figure_of(conclusion: Conclusion) -> Figure:
    """Figure of stress over strain of the held-out pull, and of either model's residual in units of the
    noise."""
    program = conclusion.explanation.program
    k = next(k for k, recording in enumerate(program.recordings) if recording.name == HELD_OUT)
    channel = program.channels[k][0]
    used = np.isfinite(channel.sigma)
    strain = np.asarray(program.recordings[k].columns["strain"])
    measured = np.asarray(channel.measured)[used] / 1e3
    models = {
        "the published law, refitted": (conclusion.explanation.base.evaluation.predicted[k][0], VERMILION),
        "with the softening that was found": (conclusion.shown.predicted[k][0], BLUE),
    }
    with style():
        figure, axes = plt.subplots(
            2,
            2,
            figsize=(8.0, 4.6),
            sharex=True,
            sharey="row",
            layout="constrained",
            height_ratios=(2.2, 1.0),
        )
        for (title, (predicted, colour)), (top, below) in zip(models.items(), axes.T, strict=True):
            predicted = np.asarray(predicted)[used] / 1e3
            top.plot(strain, measured, label="measured", **measured_marks(len(strain)))
            top.plot(strain, predicted, color=colour, lw=1.3, label="model")
            top.set_title(title)
            top.legend(loc="upper left")
            below.plot(strain, (measured - predicted) / (channel.sigma[used] / 1e3), ".", color=colour, ms=3)
            below.axhspan(-2.0, 2.0, color=GREY, alpha=0.2, lw=0)
            below.set_xlabel("engineering strain [1]")
        axes[0, 0].set_ylabel("engineering stress [kPa]")
        axes[1, 0].set_ylabel(residual_over_noise())
    return figure


def main() -> None:
    """Diagnose the campaign and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    file = parser.parse_args().file
    enable_float64()
    figure_of(diagnose(read_campaign(CAMPAIGN), seed=0)).savefig(file)


if __name__ == "__main__":
    main()
