"""Outputs that are arithmetic of the inputs: a model of the user's own that fits in a line."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.parameters.ties import RESERVED, evaluate, evaluation_order
from pneusma_jax.errors import InputError

from .response import Response, Variable


def expression_response(settings: Mapping[str, Any], inputs: Mapping[str, float], where: str) -> Response:
    """Expressions as a model.

    Args:
        settings: a study's `[model]`; its table `outputs` has an expression for each name.
        inputs: names that expressions may use, with a nominal value.
        where: file and table, for messages.

    Raises:
        InputError: if there is no expression, or one cannot be read.
    """
    table = settings.get("outputs")
    if not isinstance(table, dict) or not table or not all(isinstance(x, str) for x in table.values()):
        raise InputError(
            f"{where} needs a table outputs, such as {{y = 'sin(x1) + 7 * sin(x2)**2'}}, in names of [input]"
        )
    taken = sorted({*table} & ({*inputs} | RESERVED))
    if taken:
        raise InputError(
            f"{where} outputs: {taken[0]!r} is the name of an input or a function; choose another"
        )
    try:
        order = evaluation_order(table, {*inputs, *table})
    except InputError as error:
        raise InputError(f"{where} outputs: {as_expression(error)}") from None
    lines = [(name, table[name]) for name in order]
    try:
        evaluate(lines, {name: np.float64(value) for name, value in inputs.items()})
    except InputError as error:
        raise InputError(f"{where} outputs: {as_expression(error)}") from None

    def answer(values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        found = evaluate(lines, {**inputs, **values}, jnp)
        return {name: jnp.asarray(found[name], float) for name in table}, jnp.asarray(0)

    return Response(
        title="expressions",
        variables={name: Variable(value, "1") for name, value in inputs.items()},
        driver=None,
        outputs=dict.fromkeys(table, False),
        answer=answer,
        files=(),
        batch_size=4096,
        with_units=False,
    )


def as_expression(error: Exception) -> str:
    """Errors of an expression in a study's words: it is no tie of a parameter."""
    return str(error).replace("parameter ", "output ").replace("tie ", "expression ").replace(
        "is no parameter", "is neither input nor output").replace("parameters", "names")  # fmt: skip
