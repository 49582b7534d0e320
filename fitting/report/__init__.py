"""Presentation of results as words, figures, pages and files. Nothing here fits or simulates."""
