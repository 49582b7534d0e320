"""A posterior on paper: text, figures, netCDF."""
