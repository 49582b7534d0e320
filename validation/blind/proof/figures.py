"""Four figures of a scored run: detection, confusion, reliability, and errors on held-out values, by
method."""

from itertools import pairwise

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from fitting.report.figures import BLUE, GREEN, GREY, ORANGE

from .score import METHODS

INK = "#222222"
SHADES = LinearSegmentedColormap.from_list("shades", ["#ffffff", "#cfe0f0", BLUE])
NOT_CATALOGUED = ("unmodelled", "consistent", "error")
WIDTH, DPI = 7.2, 150
NEAR = 1.15
"""Maximum ratio of neighbouring strengths whose labels are moved apart."""


def draw(score, folder):
    """Write proof_detection, proof_confusion, proof_reliability and proof_held_out as PNG; returns their
    paths."""
    made = {
        "detection": detection(score["curve"], score["rates"]["false_alarms"]),
        "confusion": confusion(score["confusion"]),
        "reliability": reliability(score["reliability"]),
        "held_out": held_out(score["held_out"]),
    }
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, figure in made.items():
        paths.append(folder / f"proof_{name}.png")
        figure.savefig(paths[-1], dpi=DPI, facecolor="white", metadata={"Software": None})
    return paths


def _axes(height, **more):
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.add_subplot(**more)
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _points(axes, x, found, color, label, marker):
    """Rates with their intervals, joined."""
    y = np.array([f["rate"] for f in found])
    low, high = (np.array([f[side] for f in found]) for side in ("low", "high"))
    bars = np.maximum([y - low, high - y], 0.0)
    axes.errorbar(x, y, bars, color=color, marker=marker, ms=5, lw=1.6, elinewidth=1.0, capsize=2.5, label=label)


def detection(curve, false_alarms):
    """Rates of single effects over the evidence of their true form."""
    figure, axes = _axes(4.2)
    x = np.array([max(b["log_bayes"], 0.5) for b in curve])
    looks = (("detected", GREY, "called a mismatch", "s"), ("covered", ORANGE, "truth in the reported set", "D"),
             ("named_first", BLUE, "truth named first", "o"))  # fmt: skip
    for shift, (key, color, label, marker) in zip((0.96, 1.0, 1.04), looks, strict=True):
        if curve:
            _points(axes, x * shift, [b[key] for b in curve], color, label, marker)
    if false_alarms["n"]:
        text = f"false alarms {false_alarms['k']} of {false_alarms['n']}"
        axes.axhline(false_alarms["rate"], color=INK, lw=1.0, ls=":", label=text)
    axes.axvline(30.0, color=INK, lw=0.8, ls="--")
    axes.annotate("strong", (30.0, 0.02), xytext=(-4, 0), ha="right", textcoords="offset points", color=INK, fontsize=9)
    axes.set(xscale="log", ylim=(-0.03, 1.04), ylabel="share of cases, with 95 % intervals")
    axes.set_xlabel("log Bayes factor that the true form reaches after the base is refitted")
    if curve:
        top = axes.secondary_xaxis("top")
        top.set_xticks(x, [str(b["detected"]["n"]) for b in curve], fontsize=8)
        top.xaxis.set_minor_formatter(NullFormatter())
        top.set_xlabel("cases", fontsize=8)
        for left, right in pairwise(range(len(x))):
            if x[right] < NEAR * x[left]:
                top.get_xticklabels()[left].set_horizontalalignment("right")
                top.get_xticklabels()[right].set_horizontalalignment("left")
        top.spines["top"].set_visible(False)
        top.tick_params(which="both", length=0)
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=9)
    return figure


def confusion(table):
    """First-named causes of strong single effects, nulls and physics outside the catalogue."""
    said = {name for row in table.values() for name in row}
    named = sorted((set(table) | said) - set(NOT_CATALOGUED))
    rows = [n for n in [*named, *NOT_CATALOGUED] if n in table]
    columns = [n for n in [*named, *NOT_CATALOGUED] if n in said or n in table]
    counts = np.array([[table[r].get(c, 0) for c in columns] for r in rows], float).reshape(len(rows), len(columns))
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    figure, axes = _axes(max(3.2, 0.22 * len(rows) + 2.2))
    axes.imshow(shares, cmap=SHADES, vmin=0.0, vmax=1.0, aspect="auto")
    for (i, j), count in np.ndenumerate(counts):
        if count:
            color, size = "white" if shares[i, j] > 0.6 else INK, 7 if count < 100 else 5.5
            axes.text(j, i, f"{count:.0f}", ha="center", va="center", fontsize=size, color=color)
    words = {"consistent": "nothing", "unmodelled": "outside the catalogue"}
    axes.set_yticks(range(len(rows)), [words.get(r, r).replace("_", " ") for r in rows], fontsize=7)
    words = {"consistent": "consistent", "error": "failed"}
    axes.set_xticks(range(len(columns)), [words.get(c, c).replace("_", " ") for c in columns], rotation=90, fontsize=7)
    axes.set_xticks(np.arange(-0.5, len(columns)), minor=True)
    axes.set_yticks(np.arange(-0.5, len(rows)), minor=True)
    axes.grid(which="minor", color="#e6e6e6", lw=0.5)
    axes.tick_params(which="both", length=0)
    axes.spines[:].set_visible(False)
    axes.set(ylabel="concealed", xlabel="named first (number of cases; shade: share of the row)")
    return figure


def reliability(found):
    """Observed frequency of statements over their stated probability."""
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    looks = (("present", BLUE, "an effect is present"), ("strongest", ORANGE, "it is the strongest explanation"))
    for axes, (key, color, title) in zip(figure.subplots(1, 2, sharey=True), looks, strict=True):
        axes.plot([0, 1], [0, 1], color=INK, lw=0.9, ls="--")
        for b in found[key]:
            x, y, high = b["stated"], b["so"]["rate"], b["so"]["high"]
            axes.errorbar(x, y, [[max(y - b["so"]["low"], 0.0)], [max(high - y, 0.0)]], color=color, marker="o", ms=5, capsize=2.5)
            below = {"xytext": (0, -11)} if y < 0.05 and high < 0.05 else {"xytext": (0, 3)}
            axes.annotate(str(b["so"]["n"]), (x, high), **below, textcoords="offset points", ha="center", fontsize=7, color=INK)
        axes.set(xlim=(-0.05, 1.05), ylim=(-0.07, 1.1), xlabel="stated probability")
        axes.set_title(title, fontsize=9, loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        if key == "present":
            axes.set_ylabel("share that was so, with 95 % intervals")
    return figure


def held_out(found):
    """Reduced chi-square on held-out values, refitted base against model, by method."""
    names = [m for m in ("pneusma diagnose", *METHODS) if m in found and m != "recalibration"]
    figure = Figure(figsize=(WIDTH, 2.9 if len(names) < 3 else 5.8), layout="constrained")
    across = min(len(names), 2)
    grid = figure.subplots(-(-len(names) // across), across, sharex=True, sharey=True, squeeze=False)
    pairs = {m: np.array([p for p in found[m].values() if None not in p], float).reshape(-1, 2) for m in names}
    every = np.concatenate([np.ravel(p) for p in pairs.values()] or [[1.0]])
    low, high = (0.7, 2.0) if every.size == 0 else (0.8 * min(every.min(), 0.8), 1.3 * max(every.max(), 2.0))
    for axes, name in zip(grid.flat, names, strict=False):
        before, after = pairs[name].T
        axes.plot([low, high], [low, high], color=INK, lw=0.9, ls="--")
        axes.axhline(1.3, color=GREEN, lw=0.9, ls=":")
        axes.plot(before, after, "o", ms=4, mew=0.0, alpha=0.6, color=BLUE if name == names[0] else ORANGE)
        better = f"{np.sum(after < 0.98 * before)} of {len(after)} better, {np.sum(after > 1.02 * before)} worse"
        axes.set_title(f"{name.replace('_', ' ')}: {better}", fontsize=9, loc="left")
        axes.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, high))
        axes.spines[["top", "right"]].set_visible(False)
    for axes in list(grid.flat)[len(names) :]:
        axes.set_visible(False)
    figure.supxlabel("reduced chi-square of the refitted base (recalibration only)", fontsize=10)
    figure.supylabel("of the model with the correction", fontsize=10)
    return figure
