"""Reports on inverse problems."""
