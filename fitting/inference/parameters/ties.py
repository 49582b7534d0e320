"""Parameters tied to others by an expression, such as `2*mu` or `c_10 + c_20`.

`asteval`, the interpreter of lmfit, evaluates expressions in its minimal form: no statements, imports or
attributes. Elementwise functions are NumPy's outside a traced program and `jax.numpy`'s inside one. So a tie
differentiates and compiles like the rest of a model.
"""

import ast
import math
from collections.abc import Iterable, Mapping
from types import ModuleType
from typing import Any

import numpy as np
from asteval import Interpreter

from pneusma_jax.errors import InputError, nearest

FUNCTIONS = (
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "tanh"),
    *("exp", "expm1", "log", "log1p", "log10", "sqrt", "abs", "minimum", "maximum", "where"),
)
"""Functions that an expression may call, by their names in NumPy."""
CONSTANTS = {"pi": math.pi}
"""Values of names that are no parameters."""
RESERVED = frozenset(FUNCTIONS) | frozenset(CONSTANTS)
"""Names with a meaning of their own in expressions; no parameter may have one of them."""

_ALLOWED_NODES = (
    *(ast.Expression, ast.Name, ast.Load, ast.Constant, ast.BinOp, ast.UnaryOp, ast.Call, ast.Compare),
    *(ast.operator, ast.unaryop, ast.cmpop),
)
"""Parts of Python's grammar that an expression may have."""


def _short(expression: str) -> str:
    """An expression in quotes for a message, of at most 80 characters."""
    return repr(expression if len(expression) <= 80 else f"{expression[:77]}...")


def names_in(expression: str, owner: str) -> set[str]:
    """Names of the parameters in an expression.

    Args:
        expression: expression of the tie.
        owner: name of the tied parameter, for the message.

    Raises:
        InputError: if the text is not one arithmetic expression.
    """
    try:
        tree = ast.parse(expression.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # the last two from thousands of terms
        raise InputError(
            f"parameter {owner!r}: tie {_short(expression)} is not an expression like '2*mu' or 'c_10 + c_20'"
        ) from None
    for node in ast.walk(tree):
        numeric = not isinstance(node, ast.Constant) or isinstance(node.value, int | float)
        known = isinstance(node, _ALLOWED_NODES)
        if not (known and numeric) or (isinstance(node, ast.Call) and node.keywords):
            raise InputError(
                f"parameter {owner!r}: tie {expression!r} may only hold numbers, parameters, + - * / ** "
                f"and the functions {', '.join(FUNCTIONS)}"
            )
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names = [node for node in ast.walk(tree) if isinstance(node, ast.Name)]
    for node in names:
        is_called, is_function = id(node) in called, node.id in FUNCTIONS
        if is_function and not is_called:
            raise InputError(
                f"parameter {owner!r}: tie {expression!r} gives {node.id!r} no argument; write {node.id}(...)"
            )
        if is_called and not is_function:
            raise InputError(
                f"parameter {owner!r}: tie {expression!r} calls {node.id!r}; {nearest(node.id, FUNCTIONS)}"
            )
    return {node.id for node in names} - RESERVED


def evaluation_order(ties: Mapping[str, str], names: Iterable[str]) -> tuple[str, ...]:
    """Tied parameters in topological order: each comes after all that it depends on.

    Args:
        ties: expression by tied parameter.
        names: names of all parameters.

    Raises:
        InputError: if an expression names a parameter that does not exist, or depends on itself.
    """
    names = set(names)
    needs = {}
    for owner, expression in ties.items():
        needs[owner] = names_in(expression, owner)
        unknown = sorted(needs[owner] - names)
        if unknown:
            raise InputError(
                f"parameter {owner!r}: tie {expression!r} names {unknown[0]!r}, which is no parameter; "
                f"{nearest(unknown[0], names - {owner})}"
            )
    order: list[str] = []

    def visit(owner: str, path: tuple[str, ...]) -> None:
        if owner in path:
            cycle = " -> ".join((*path[path.index(owner) :], owner))
            raise InputError(f"parameter {owner!r}: ties run in a circle ({cycle}); free or fix one of them")
        if owner in order or owner not in needs:
            return
        for name in sorted(needs[owner]):
            visit(name, (*path, owner))
        order.append(owner)

    for owner in needs:
        visit(owner, ())
    return tuple(order)


def evaluate(
    ties: Iterable[tuple[str, str]], values: Mapping[str, Any], functions: ModuleType = np
) -> dict[str, Any]:
    """All values, including those of tied parameters.

    Args:
        ties: pairs (tied parameter, expression) in evaluation order.
        values: numbers or traced scalars of the others.
        functions: module `numpy`, or `jax.numpy` for traced values.

    Returns:
        `values` and the tied ones, as a new dictionary.

    Raises:
        InputError: if an expression cannot be evaluated.
    """
    values = dict(values)
    table = CONSTANTS | {name: getattr(functions, name) for name in FUNCTIONS} | values
    interpreter = Interpreter(symtable=table, minimal=True, use_numpy=False)
    for owner, expression in ties:
        try:
            with np.errstate(all="ignore"):
                result = interpreter(expression, raise_errors=True)
        except Exception as problem:
            reason = str(problem).strip().splitlines()[-1]
            raise InputError(
                f"parameter {owner!r}: tie {expression!r} cannot be evaluated: {reason}"
            ) from None
        interpreter.symtable[owner] = values[owner] = result
    return values
