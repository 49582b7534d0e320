"""Densities of several campaigns in one program: those of one form are stacked and mapped over.

A program that goes through its campaigns one after the other compiles each of them anew. A derivative by
forward mode goes through all of them for each parameter of any. Side by side they compile once. Each
likelihood has the gradient by its own campaign's parameters alone; the chain rule does the rest.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, PyTree

from fitting.inference.parameters import Layout
from fitting.specimens.rows import Rows, stack
from pneusma_jax.errors import InputError

from .gradients import differentiation, with_gradient
from .likelihood import KnownNoise, Residual
from .target import Target


@dataclass(frozen=True)
class Form:
    """Campaigns that share one program.

    Attributes:
        members: numbers of the campaigns.
        layout: conversion of a campaign's coordinates to its values.
        residual: residual of a campaign.
        data: values of the parameters that are not free, shape (campaigns, all); and data of the residual,
            with the campaigns along the first axis of every array.
        likelihood: log-likelihood of a campaign, a function of its coordinates, `stored` and data; with
            derivatives.
    """

    members: tuple[int, ...]
    layout: Layout
    residual: Residual
    data: tuple[Array, PyTree]
    likelihood: Callable[[Array, Array, PyTree], Array]

    def rows(self, vector: Array, stored: Array, data: PyTree) -> Array:
        """Residual of one campaign, shape (rows,)."""
        return _rows(self.residual, self.layout, vector, stored, data)


def side_by_side(targets: Sequence[Target]) -> list[Form]:
    """Campaigns by form: equal residual, parameters and structure of the data; shapes are made equal.

    Args:
        targets: density of each campaign, of known noise.

    Raises:
        InputError: if the noise of a campaign is not known.
    """
    alike: dict[Any, list[int]] = {}
    data = [target.data for target in targets]
    for k, target in enumerate(targets):
        if not isinstance(target.likelihood, KnownNoise):
            raise InputError("a joint posterior needs recordings whose noise is known; this kind has none")
        alike.setdefault(_key(target, data[k], isinstance(data[k], Rows)), []).append(k)
    forms = []
    for members in alike.values():
        grown = _of_one_shape([data[k] for k in members])
        forms += [
            _form(targets, [members[i] for i in same], [grown[i] for i in same]) for same in _by_shape(grown)
        ]
    return forms


def _form(targets: Sequence[Target], members: Sequence[int], data: Sequence[PyTree]) -> Form:
    first = targets[members[0]]
    residual, layout = first.likelihood.residual, first.layout

    def plain(vector: Array, stored: Array, data: PyTree) -> Array:
        return -0.5 * jnp.sum(_rows(residual, layout, vector, stored, data) ** 2)

    stored = jnp.stack([targets[k].stored for k in members])
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *data)
    how = differentiation(plain, jnp.zeros(len(layout.free)), first.stored, data[0])
    return Form(tuple(members), layout, residual, (stored, stacked), with_gradient(plain, how))


def _rows(residual: Residual, layout: Layout, vector: Array, stored: Array, data: PyTree) -> Array:
    return jnp.ravel(residual(layout.values(vector, stored), data))


def _key(target: Target, data: PyTree, shapes_may_differ: bool) -> tuple:
    structure = jax.tree.structure(data)
    return target.likelihood.residual, target.layout, structure, shapes_may_differ or _shapes(data)


def _shapes(data: PyTree) -> tuple:
    return tuple((leaf.shape, str(leaf.dtype)) for leaf in jax.tree.leaves(data))


def _by_shape(data: Sequence[PyTree]) -> list[list[int]]:
    """Places of data that have the same shapes."""
    found: dict[tuple, list[int]] = {}
    for k, one in enumerate(data):
        found.setdefault(_shapes(one), []).append(k)
    return list(found.values())


def _of_one_shape(data: Sequence[PyTree]) -> list[PyTree]:
    """Stacks of recordings padded to one number of rows and of recordings; other data as they are."""
    if not all(isinstance(one, Rows) for one in data):
        return list(data)
    parts = [[jax.tree.map(lambda x, i=i: x[i], one) for i in range(one.mask.shape[0])] for one in data]
    widest = None
    for own in parts:
        widest = stack(own, widest)
    return [stack(own, widest) for own in parts]
