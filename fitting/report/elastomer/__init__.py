"""Report on the characterisation of an elastomer."""
