"""Reports on closed-loop control."""
