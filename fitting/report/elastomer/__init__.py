"""The characterisation of an elastomer on paper."""
