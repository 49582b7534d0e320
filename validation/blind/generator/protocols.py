"""Shapes of drives: ramps, holds, ripple of a controller, heat that follows a current."""

import numpy as np


def way(corners, values, count, *, hold_jitter=0.0, rng=None):
    """Piecewise linear series of `count` rows through `values` at the fractions `corners` of the whole."""
    x = np.linspace(0.0, 1.0, count)
    corners = np.asarray(corners, float)
    if rng is not None and hold_jitter:
        inner = corners[1:-1] + hold_jitter * rng.uniform(-1, 1, len(corners) - 2) * np.min(np.diff(corners))
        corners = np.concatenate([corners[:1], inner, corners[-1:]])
    return np.interp(x, corners, values)


def triangles(peaks, count, valley=0.0, start=0.0):
    """Up and down through the peaks in turn, at one rate."""
    values, where = [start], [0.0]
    for number, peak in enumerate(peaks):
        down = start if number == len(peaks) - 1 else valley
        for value in (peak, down):
            where.append(where[-1] + abs(value - values[-1]) + 1e-12)
            values.append(value)
    return way(np.array(where) / where[-1], values, count)


def step_and_hold(level, count, rise=0.12, second=None):
    """A rise, a long hold, and half-way down (or to `second`) with another hold, then back to zero."""
    second = 0.45 * level if second is None else second
    return way([0, rise, 0.5, 0.5 + 0.7 * rise, 0.9, 1], [0, level, level, second, second, 0], count)


def chatter(rng, count, period):
    """Ripple of a controller: a noisy oscillation of unit size and a period in rows.

    Periods below some 16 rows would vanish in any smoothing of a noisy resistance. A stand that samples so
    slowly would be unusable.
    """
    radius, turn = 0.97, 2.0 * np.pi / period
    kick = rng.standard_normal(count + 120)
    x = np.zeros(count + 120)
    for n in range(2, count + 120):
        x[n] = 2 * radius * np.cos(turn) * x[n - 1] - radius**2 * x[n - 2] + kick[n]
    x = x[120:]
    return x / np.std(x)


def fraction_at(temperature, middle, width, ambient):
    """Martensite fraction over temperature, one at rest."""
    rest = 1.0 / (1.0 + np.exp((ambient - middle) / width))
    return np.minimum(1.0, 1.0 / (1.0 + np.exp((temperature - middle) / width)) / rest)


def temperature_for(fraction, middle, width, ambient):
    """The temperature at which `fraction_at` gives a fraction below one."""
    rest = 1.0 / (1.0 + np.exp((ambient - middle) / width))
    share = np.clip(fraction * rest, 1e-4, rest)
    return np.maximum(middle + width * np.log(1.0 / share - 1.0), ambient)


class Heater:
    """A spring heated by its current in still air: exact steps of m c dT/dt = I^2 R - h A (T - T_ambient)."""

    def __init__(self, rng, middle=31.0, width=2.5):
        self.middle = middle + rng.normal(0.0, 0.8)
        self.width, self.ambient = width, 22.0 + rng.normal(0.0, 0.7)
        length, wire = 0.1884, 0.25e-3
        self.loss = 60.0 * np.exp(rng.normal(0.0, 0.2)) * np.pi * wire * length
        self.capacity = 6450.0 * 500.0 * 0.25 * np.pi * wire**2 * length
        self.ohm = 3.5

    def respond(self, time, current):
        """Temperature [degC] that a current [A] leads to."""
        temperature = np.empty_like(time)
        now = self.ambient
        for n in range(len(time)):
            if n:
                goal = self.ambient + self.ohm * current[n - 1] ** 2 / self.loss
                now = goal + (now - goal) * np.exp(-(time[n] - time[n - 1]) * self.loss / self.capacity)
            temperature[n] = now
        return temperature

    def current_for(self, temperature):
        """Steady current [A] for a temperature."""
        return np.sqrt(np.maximum(temperature - self.ambient, 0.0) * self.loss / self.ohm)

    def fraction(self, temperature):
        """Martensite fraction at a temperature."""
        return fraction_at(temperature, self.middle, self.width, self.ambient)

    def cycle(self, rng, time, shape, coldest):
        """Current, temperature and fraction for a heating profile `shape` (0 to 1) whose peak reaches
        `coldest`."""
        peak = temperature_for(coldest, self.middle, self.width, self.ambient)
        current = self.current_for(peak) * np.sqrt(shape)
        ripple = 0.03 * rng.uniform(0.3, 1.0) * chatter(rng, len(time), rng.uniform(16, 36))
        current = np.maximum(current * (1.0 + ripple), 0.0)
        temperature = self.respond(time, current)
        return current, temperature, self.fraction(temperature)
