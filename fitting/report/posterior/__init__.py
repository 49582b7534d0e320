"""Report on a posterior: text, figures, netCDF."""
