"""Simulated campaigns that ship with the package, made again by a command each."""
