"""Many small arrays as few large ones, since a compiled program takes time for each of its arguments."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

SEPARATOR = "\n"
"""Character between the names of a group; no name has it."""


@partial(jax.tree_util.register_dataclass, data_fields=["flat"], meta_fields=["forms", "structure"])
@dataclass(frozen=True)
class Packed:
    """A tree of arrays as one flat array for each type of number.

    Attributes:
        flat: arrays by name of the type, each (values,).
        forms: type and shape of every leaf.
        structure: of the tree.
    """

    flat: dict[str, np.ndarray | jax.Array]
    forms: tuple[tuple[str, tuple[int, ...]], ...]
    structure: Any

    @classmethod
    def of(cls, tree: Any) -> "Packed":
        """Pack a tree of NumPy arrays."""
        leaves, structure = jax.tree.flatten(tree)
        leaves = [np.asarray(leaf) for leaf in leaves]
        groups: dict[str, list[np.ndarray]] = {}
        for leaf in leaves:
            groups.setdefault(leaf.dtype.name, []).append(leaf.ravel())
        flat = {name: np.concatenate(members) for name, members in groups.items()}
        return cls(flat, tuple((leaf.dtype.name, leaf.shape) for leaf in leaves), structure)

    @property
    def tree(self) -> Any:
        """The tree itself; may be traced."""
        leaves, first = [], dict.fromkeys(self.flat, 0)
        for name, shape in self.forms:
            size = int(np.prod(shape))
            part = self.flat[name][first[name] : first[name] + size]
            leaves.append(jnp.reshape(part, shape))
            first[name] += size
        return self.structure.unflatten(leaves)


@partial(jax.tree_util.register_dataclass, data_fields=["values"], meta_fields=["names"])
@dataclass(frozen=True)
class Named:
    """Columns of one array by name.

    Attributes:
        values: shape (..., names).
        names: of the last axis.
    """

    values: np.ndarray | jax.Array
    names: tuple[str, ...]

    @property
    def columns(self) -> dict[str, jax.Array]:
        """Each column by its name; may be traced."""
        return {name: self.values[..., k] for k, name in enumerate(self.names)}


class Grouped:
    """Arrays by name, those of one shape and type as one array: reading each takes time.

    Names are keys of the groups, so that a stored program says which arrays it returns.
    """

    @staticmethod
    def of(arrays: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
        """Groups of arrays by their joined names; may be traced."""
        groups: dict[tuple, list[str]] = {}
        for name, array in arrays.items():
            groups.setdefault((array.shape, array.dtype), []).append(name)
        return {SEPARATOR.join(names): jnp.stack([arrays[n] for n in names]) for names in groups.values()}

    @staticmethod
    def apart(groups: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The arrays of groups by name."""
        pairs = ((names.split(SEPARATOR), whole) for names, whole in groups.items())
        return {n: x for names, whole in pairs for n, x in zip(names, whole, strict=True)}
