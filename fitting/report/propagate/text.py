"""The sentences of a report on a propagated study, and the preview of its plan."""

from dataclasses import replace

import numpy as np

from fitting.inference.notes import joined
from fitting.inference.progress import duration
from fitting.propagate import Propagation
from fitting.propagate.chunk import INDEPENDENT
from fitting.propagate.problem import Problem
from fitting.propagate.rare import RareResult
from fitting.propagate.responses import reason, undefined_output
from pneusma_jax.actuator.result import solved
from pneusma_jax.errors import counted

from ..cells import digits_apart, number, told_apart, with_half_width
from ..table import table_text
from .numbers import TELLING, bounds_of, by_chance, exceedances, lost, shown_column, too_few
from .tables import input_table

MOST_TOLD = 4
"""Maximum number of outputs that have sentences of their own."""
MOST_CAUSES = 3
"""Maximum number of inputs that a sentence names for one output."""
SUMS_BYTES = 16_000
"""Approximate size on disk of the sums that a chunk keeps of one column [bytes]."""


def _rows(count: int) -> str:
    """A number of rows in words, its thousands grouped."""
    return f"{count:,} {'row' if count == 1 else 'rows'}"


def verdict(result: Propagation) -> list[str]:
    """The few most important sentences."""
    problem, sentences = result.problem, []
    failures = result.summary.failures
    words = {"sobol": "Sobol points", "monte_carlo": "random draws", "latin_hypercube": "Latin hypercubes"}
    inputs, method = counted(len(problem.inputs.names), "input"), words[problem.study.sampling.method]
    sentences.append(
        f"{problem.response.title}: {_rows(problem.rows)}. A row is the model computed once, with one set of "
        f"values of {inputs} ({method}).{_rounded(problem)}"
    )
    sentences += [_quantity(result, quantity.name) for quantity in problem.columns.quantities[:MOST_TOLD]]
    rest = len(problem.columns.quantities) - MOST_TOLD
    if rest > 0:
        sentences.append(f"{counted(rest, 'more output is', 'more outputs are')} in the table.")
    for found in exceedances(result):
        sentences.append(
            f"{problem.columns.limit(found.limit)}: in {_percent(found.probability[-1])} of rows, "
            f"{_percents(found.low[-1], found.high[-1])} (95 %)."
        )
    small = [_with_unit(rare, problem) for rare in result.rare.values()]
    sentences += [sentence for rare in small for sentence in rare_sentences(rare)]
    if result.summary.indices is not None:
        sentences += _index_sentences(result)
    if failures.count:
        sentences += failure_sentences(result)
    return sentences


def touching(result: Propagation) -> list[str]:
    """Sentence on rows in which the body may touch itself; none where there are no such rows."""
    found = result.summary.touching
    if not found.rows:
        return []
    angle = " to ".join(dict.fromkeys(f"{end:.0f}" for end in (found.least, found.most)))
    return [
        f"In {int(found.rows):,} of {_rows(result.summary.failures.total)} the body bends by {angle} degrees "
        "in all, and may touch itself. Contact is not modelled, and these rows count as all others do"
    ]


def _with_unit(rare: RareResult, problem: Problem) -> RareResult:
    """A small probability whose limit has its unit."""
    return replace(rare, limit=problem.columns.limit(rare.limit))


def _rounded(problem: Problem) -> str:
    """Sentences on rows beyond those that were asked for, and on those that bands count; or nothing."""
    asked, block, text = problem.study.sampling.rows, problem.design.block, ""
    if problem.rows != asked:
        text = (
            f" The study asks for {asked:,}. Indices need whole blocks of {block} rows, so there are"
            f" {problem.rows:,}."
        )
    if block > INDEPENDENT:
        text += (
            f" {INDEPENDENT} rows of each block of {block} are independent. Bands, shares of rows and their "
            f"intervals count these {INDEPENDENT * problem.points:,} alone."
        )
    return text


def _quantity(result: Propagation, name: str) -> str:
    k = shown_column(result, name)
    low, middle, high = result.quantiles([0.05, 0.5, 0.95])[:, k]
    if not np.isfinite(middle):
        return f"{result.problem.columns.shown[k]}: no row has a result."
    nominal = result.nominal[k]
    beside = f", nominal {number(nominal, f'.{digits_apart(low, high)}g')}" if np.isfinite(nominal) else ""
    failures = result.summary.failures
    if failures.count:
        beside += f", of the {_rows(int(result.moments.count[k]))} with a result"
    label = result.problem.columns.shown[k]
    if low == high:
        least, most = result.moments.smallest[k], result.moments.largest[k]
        rest = "" if least == most else f", and all between {' and '.join(told_apart(least, most))}"
        return f"{label}: {middle:.4g} in 90 % of rows or more, which have no spread{rest}{beside}."
    texts = told_apart(low, middle, high)
    return f"{label}: median {texts[1]}, 90 % of rows between {texts[0]} and {texts[2]}{beside}."


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _percents(low: float, high: float) -> str:
    """Ends of an interval of shares."""
    return " to ".join(f"{text} %" for text in told_apart(100.0 * low, 100.0 * high, least=3))


def _index_sentences(result: Propagation) -> list[str]:
    """A sentence on the indices of each of the first outputs that have some."""
    problem, sums = result.problem, result.summary.indices
    names = problem.study.indices.of or [quantity.name for quantity in problem.columns.quantities]
    sentences = [_causes(result, shown_column(result, name)) for name in names[:MOST_TOLD]]
    if len(names) > MOST_TOLD:
        sentences.append(f"The table has the indices of {counted(len(names) - MOST_TOLD, 'more output')}.")
    return [*sentences, _left_out(result)] if sums.left_out else sentences


def _causes(result: Propagation, shown: int) -> str:
    """Sentence on the inputs on which a column depends most, or why it has no indices."""
    problem, sums = result.problem, result.summary.indices
    kind = "total" if sums.kind == "sobol" else "shapley"
    found = sums.estimates()[kind]
    label, j = problem.columns.shown[shown], list(problem.index_columns).index(shown)
    value, half_width = (numbers[:, j] for numbers in found)
    if not np.any(np.isfinite(value)):
        same = result.moments.smallest[shown] == result.moments.largest[shown]
        why = "it is the same in every row" if same else "its variance is zero or no finite number"
        return f"{label} has no indices: {'no block is whole' if sums.left_out == sums.blocks else why}."
    if not np.any(np.isfinite(half_width)):
        few = f"indices of so few rows, {sums.blocks - sums.left_out} whole blocks, have no interval"
        return f"{label}: {few}; take more."
    groups, words = list(problem.groups), "total Sobol index" if kind == "total" else "Shapley effect"
    order = [int(i) for i in np.argsort(-np.nan_to_num(value, nan=-1.0))[:MOST_CAUSES]]
    parts = ", ".join(f"{groups[i]} {with_half_width(value[i], half_width[i], 2)}" for i in order)
    told = f"What {label} depends on most ({words}, 95 %): {parts}."
    if np.any(value > half_width):
        return told
    return f"{told} No interval is above zero, so these rows do not tell one input from another: take more."


def _left_out(result: Propagation) -> str:
    share = _percent(result.summary.indices.share_left_out)
    return (
        f"{share} of blocks have a row without a result and are left out whole; the table has the bounds of "
        "each index, whatever these rows would have been."
    )


def failure_sentences(result: Propagation) -> list[str]:
    """Sentences on the number of rows without a result, their causes and places, and their possible
    influence."""
    failures, problem = result.summary.failures, result.problem
    codes = [code for code in np.flatnonzero(failures.reasons) if not solved(code)]
    outputs = [quantity.name for quantity in problem.columns.quantities]
    why = "; ".join(f"{failures.reasons[c]:,}: {reason(int(c), outputs).rstrip('.')}" for c in codes)
    sentences = [
        f"{_rows(failures.count)} ({_percent(lost(result))}) {'has' if failures.count == 1 else 'have'} no "
        f"result ({why})."
    ]
    undefined = [name for c in codes if (name := undefined_output(int(c), outputs)) is not None]
    if undefined and len(outputs) > len(undefined):
        sentences.append(
            "Such a row counts for no output. A study that leaves out "
            f"{joined(undefined)} counts it for the others."
        )
    distance = failures.uneven
    names = problem.inputs.names
    k = int(np.argmax(distance))
    if distance[k] > max(TELLING, by_chance(result)):
        worst = int(np.argmax(failures.shares[k]))
        bins = failures.shares.shape[1]
        sentences.append(
            f"They differ from other rows most in {names[k]}: of its values between the "
            f"{100 * worst // bins} and {100 * (worst + 1) // bins} % quantile, "
            f"{_percent(failures.shares[k, worst])}"
            " have none."
        )
    elif too_few(result):
        sentences.append("So few do not tell in which input they differ from other rows.")
    else:
        sentences.append("No single input tells them apart from other rows.")
    return sentences


def _end(probability: float) -> str:
    """End of an interval; the digits of one close to 1 tell how close it is."""
    return f"{probability:.2g}" if probability < 0.95 else f"{probability:.6g}"


def rare_sentences(rare: RareResult) -> list[str]:
    """Sentences on a small probability."""
    sentences = []
    if rare.subset is not None:
        low, high = rare.subset.interval
        stalled = rare.subset.stalled
        runs = len(rare.subset.each)
        note = (
            f" {stalled} of {runs} runs came no closer to the limit and counted what they had."
            if stalled
            else ""
        )
        sentences.append(
            f"{rare.limit}: probability {rare.subset.probability:.3g} by subset simulation, {_end(low)} to "
            f"{_end(high)} (95 %).{note}"
        )
    if rare.form is not None:
        low, high = rare.form.interval
        points = len(rare.form.betas)
        points_text = counted(points, "design point") if points else "no design point"
        by = "" if rare.form.by_form is None else f"; FORM alone {rare.form.by_form:.3g}"
        sentences.append(
            f"{rare.limit}: {rare.form.probability:.3g} by importance sampling ({points_text}), "
            f"{_end(low)} to {_end(high)} (95 %){by}."
        )
    if rare.no_gradient:
        sentences.append(f"{rare.limit}: no FORM, because {rare.no_gradient}.")
    if rare.agree is False:
        sentences.append(f"{rare.limit}: the two DISAGREE; believe neither before a run with more samples.")
    spent = f"{rare.rows:,} rows were spent on {rare.limit}"
    lost_rows = (
        f", of which {rare.without_result:,} have no result and count as not failed"
        if rare.without_result
        else ""
    )
    return [*sentences, f"{spent}{lost_rows}."]


def speed(result: Propagation) -> str:
    """Number of rows that this session computed, and its speed; empty where it computed none."""
    if not result.computed:
        return ""
    rate = result.computed / max(result.seconds, 1e-9)
    return (
        f"{_rows(result.computed)} computed in {duration(result.seconds)}, {rate:,.0f} a second with "
        "compiling."
    )


def plan_text(problem: Problem) -> str:
    """Preview of a study."""
    lines = [
        f"{problem.study.name}: {problem.response.title}",
        f"  {_rows(problem.rows)} in {len(problem.tasks):,} chunk{'s' * (len(problem.tasks) != 1)}, "
        f"{counted(problem.columns.total, 'column')}",
        f"  on disk about {_on_disk(problem)}",
        f"  {counted(len(problem.inputs.names), 'input')}:",
    ]
    return "\n".join([*lines, table_text(input_table(problem), 4)])


def _on_disk(problem: Problem) -> str:
    """Size of a study's files, in MB."""
    rows = problem.rows * (8 * problem.columns.total + 1) if problem.study.sampling.keep == "outputs" else 0
    sums = len(problem.tasks) * SUMS_BYTES * problem.columns.total
    return f"{(rows + sums) / 1e6:,.0f} MB"


def bounds_sentence(result: Propagation) -> str:
    """Sentence on the possible influence of rows without a result on the first output."""
    if not np.isfinite(result.moments.mean[0]):
        return "No row has a result, so nothing is known of the outputs."
    found = bounds_of(result)
    ends = [float(end[0]) for end in found.mean]
    digits = digits_apart(*ends)
    low, high = (np.format_float_positional(end, digits, fractional=False) for end in ends)
    return (
        "If every row without a result lay within what was seen, the mean of "
        f"{result.problem.columns.shown[0]} would be between {low} and {high}. At the widest, 90 % of rows "
        f"would be between {' and '.join(told_apart(found.q5_least[0], found.q95_most[0]))}."
    )
