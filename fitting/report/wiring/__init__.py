"""Reports on springs on one pair of wires."""
