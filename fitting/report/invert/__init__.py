"""Inverse problems on paper."""
