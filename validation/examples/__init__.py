"""Simulated campaigns that ship with the package, each reproduced by a command."""
