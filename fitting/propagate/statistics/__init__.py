"""Statistics of rows in one pass: parts of a study are summed up each on its own, and the sums are merged."""
