"""A recording that is nothing but one column."""


class Column:
    """A recording of one quantity, with its stated noise, or None."""

    def __init__(self, name, values, noise):
        self.name, self.values, self.noise = name, values, noise

    def __len__(self):
        return len(self.values)

    def has(self, name):
        return name == self.name

    def si(self, name):
        return self.values

    def noise_si(self, name):
        return self.noise
