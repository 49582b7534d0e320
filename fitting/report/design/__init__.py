"""Design studies on paper."""
