"""Springs on one pair of wires, on paper."""
