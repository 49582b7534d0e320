"""Closed loops on paper."""
