"""Report on a plan of tests: text, figure and files."""
