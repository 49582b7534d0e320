"""Report on the characterisation of a wire, tube or actuator."""
