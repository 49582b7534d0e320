"""Reachable bends of actuators and chains, over pressure and activation."""

from .chain import ChainReach, compute_chain_reach
from .grid import DESIGNS, Workspace, compute_workspace, join_columns

__all__ = [
    "DESIGNS", "ChainReach", "Workspace", "compute_chain_reach", "compute_workspace", "join_columns",
]  # fmt: skip
