"""Report on the characterisation of a spring."""
