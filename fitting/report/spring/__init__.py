"""The characterisation of a spring on paper."""
