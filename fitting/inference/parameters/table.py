"""Parameters as text, in the manner of lmfit's `fit_report`."""

import math
from collections.abc import Iterable, Sequence

from .parameter import Parameter


def format_estimate(value: float, standard_error: float | None = None) -> str:
    """A number with as many digits as its standard error supports: `"0.0885 +/- 0.0012"`.

    Args:
        value: value to format.
        standard_error: standard error (two significant digits are shown), or None for six digits and none.
    """
    if standard_error is None or not 0 < standard_error < math.inf:
        return f"{value:.6g}"
    exponent = math.floor(math.log10(max(abs(value), standard_error)))
    shift = exponent if not -4 <= exponent < 6 else 0
    decimals = max(1 - math.floor(math.log10(standard_error)) + shift, 0)
    text = f"{value / 10.0**shift:.{decimals}f} +/- {standard_error / 10.0**shift:.{decimals}f}"
    return f"({text})e{shift:+03d}" if shift else text


def render(parameters: Iterable[Parameter], correlations_above: float) -> str:
    """Table of parameters, and the correlations stronger than a threshold, strongest first."""
    parameters = list(parameters)
    head = ("name", "value +/- standard error", "relative", "unit", "initial", "bounds", "remarks")
    lines = _aligned([head, *(_row(parameter) for parameter in parameters)])
    pairs = [
        (abs(strength), parameter.name, other, strength)
        for i, parameter in enumerate(parameters)
        for other, strength in parameter.correlations.items()
        if abs(strength) >= correlations_above and other in {later.name for later in parameters[i + 1 :]}
    ]
    if pairs:
        lines += ["", f"correlations (those below {correlations_above:g} left out)"]
        names = [f"{first}, {second}" for _, first, second, _ in pairs]
        width = max(map(len, names))
        order = sorted(range(len(pairs)), key=lambda i: -pairs[i][0])
        lines += [f"  {names[i]:<{width}}  {pairs[i][3]:+.3f}" for i in order]
    return "\n".join(lines)


def _row(parameter: Parameter) -> tuple[str, ...]:
    error, value = parameter.standard_error, parameter.value
    relative = f"{100 * error / abs(value):.2g} %" if error is not None and value else ""
    bounded = math.isfinite(parameter.min) or math.isfinite(parameter.max)
    remarks = []
    if parameter.tie is not None:
        remarks.append(f"= {parameter.tie}")
    elif not parameter.vary:
        remarks.append("fixed")
    elif parameter.initial_value is not None and error is None:
        remarks.append("standard error not determined")
    if parameter.at_bound and parameter.vary:
        remarks.append("AT BOUND")
    return (
        parameter.name,
        format_estimate(value, error),
        relative,
        parameter.unit,
        "" if parameter.initial_value is None else f"{parameter.initial_value:.6g}",
        f"[{parameter.min:g}, {parameter.max:g}]" if bounded else "",
        ", ".join(remarks),
    )


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
