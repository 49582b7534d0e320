"""Reports on design studies."""
