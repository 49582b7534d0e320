"""A plan of tests on paper: its text, figure and files."""
