"""The characterisation of a wire, tube or actuator on paper."""
