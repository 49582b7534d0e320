"""The page of the model: its equations, written anew in NumPy, reproduce a solved row, and its functions exist."""

import importlib
import re
import tomllib
from math import erf, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import pneusma_jax as pj
from pneusma_jax.calibration import load_calibration
from pneusma_jax.nitinol.thermal import next_temperature
from pneusma_jax.serial_chain.kinematics import arc_frame

ROOT = Path(__file__).parents[2]
ALLOY = load_calibration("krl35", kind="alloy").values()
NU, WALL, PRESSURE, FRACTIONS = 0.33, 1.2e-3, 30e3, (1.0, 0.4)


def sigmoid(x, k):
    return x / (1.0 + abs(x) ** k) ** (1.0 / k)


def xi_sm(gamma):
    return (1.0 + np.exp(-ALLOY["beta_1"] * gamma - ALLOY["beta_2"])) ** -ALLOY["beta_3"]


def xi_sa(gamma):
    return (1.0 + sigmoid(ALLOY["ka_1"] * gamma + ALLOY["ka_2"], ALLOY["ka_3"])) / 2.0


def residual_strain(prestrain, xi_min):
    limit = min(0.065 * (1.0 + erf(10.32 * prestrain - 1.57)), ALLOY["gamma_L"] * xi_sm(prestrain))
    return limit * np.exp(5.0 * (xi_min - 1.0))


def stress(gamma, xi0, gamma_R):
    G_m, G_a, gamma_L = ALLOY["G_m"], ALLOY["G_a"], ALLOY["gamma_L"]
    G = xi0 * G_m + (1.0 - xi0) * G_a
    detwinning = gamma_L * (xi0 * G_m * xi_sm(gamma) + (1.0 - xi0) * G_a * xi_sa(gamma))
    return G * gamma - max(detwinning, G * gamma_R)


def exponent(gamma):
    return ALLOY["a"] + (1.0 - ALLOY["a"]) * (gamma / ALLOY["gamma_max"]) ** ALLOY["b"]


def phase_resistivities(gamma):
    turned = sigmoid(ALLOY["km_1"] * xi_sm(gamma) + ALLOY["km_2"], ALLOY["km_3"])
    rho_m = ALLOY["rho_mean"] + 0.5 * ALLOY["rho_span"] * turned
    return rho_m, ALLOY["alpha_1"] + ALLOY["alpha_2"] * xi_sa(gamma)


def shear_strain(eps, pitch, D, C):
    s, s_i = pitch * (1.0 + eps) / (2.0 * D), pitch / (2.0 * D)
    opening = s / sqrt(1.0 + s**2) - s_i / sqrt(1.0 + s_i**2)
    return (1.0 + s**2) ** 2 / (C * (1.0 + s_i**2) * (1.0 + s**2 / (1.0 + NU))) * opening


TABLE = tomllib.loads((ROOT / "calibration_data" / "dragon_skin_10_fast.toml").read_text())


def polynomial(test, eps):
    entries = TABLE[test]
    names = sorted(name for name in entries if name.startswith("p_"))
    p = np.array([entries[name]["value"] * 1e3 for name in names[:-1]] + [0.0])
    inside = np.clip(eps, -0.54, 1.5)
    slope = np.polyval(np.polyder(p), inside)
    return np.polyval(p, inside) + max(slope, 50e3) * (eps - inside)


def silicone(eps):
    u = np.clip((eps + 0.02) / 0.04, 0.0, 1.0)
    w = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    return w * polynomial("standard_tension", eps) + (1.0 - w) * polynomial("needle_buckling", eps)


@pytest.fixture(scope="module")
def solved():
    actuator = pj.make_actuator("pneusma2", wall_thickness=WALL)
    return actuator, pj.solve(actuator, PRESSURE, tuple(pj.MartensiteFraction(x) for x in FRACTIONS))


def test_the_equations_of_a_spring(solved):
    actuator, row = solved
    geometry, attached = actuator.springs[0].geometry, float(actuator.springs[0].attached_length)
    d, pitch = float(geometry.wire_diameter), float(geometry.initial_pitch)
    free, coils = float(geometry.free_length), float(geometry.active_coils)
    D = float(geometry.mandrel_diameter) + d
    C, length = D / d, coils * sqrt((pi * D) ** 2 + pitch**2)
    W = (4.0 * C - 1.0) / (4.0 * C - 4.0) + 0.615 / C
    for k, place in enumerate((1.0, -1.0)):
        xi0 = FRACTIONS[k]
        delta = float(row.delta_centre) + float(row.bend_angle) * place * float(row.radius)
        gamma = shear_strain((attached + delta - free) / free, pitch, D, C)
        tau = stress(gamma, xi0, residual_strain(0.1924, min(1.0, xi0)))
        rho_m, rho_a = phase_resistivities(gamma)
        rho = xi0 ** exponent(gamma) * rho_m + (1.0 - xi0 ** exponent(gamma)) * rho_a
        found = row.springs[k]
        assert float(found.gamma) == pytest.approx(gamma, rel=1e-12)
        assert float(found.force) == pytest.approx(pi * d**2 * tau / (8.0 * C * W), rel=1e-12)
        assert float(found.resistance) == pytest.approx(rho * length, rel=1e-12)
        back = np.clip((rho - rho_a) / (rho_m - rho_a), 0.0, 1.0) ** (1.0 / exponent(gamma))
        assert back == pytest.approx(xi0, rel=1e-9)


def test_the_balance_of_an_actuator(solved):
    actuator, row = solved
    L_0, R, d_i = float(actuator.length), float(row.radius), 2.0 * (float(row.radius) - WALL)
    delta_c, theta = float(row.delta_centre), float(row.bend_angle)

    def disc(radius, lever):
        def integrand(phi):
            s = radius * np.sin(phi)
            return silicone((delta_c + theta * s) / L_0) * lever(s) * 2.0 * radius**2 * np.cos(phi) ** 2

        return quad(integrand, -pi / 2.0, pi / 2.0, epsabs=1e-14, epsrel=1e-10, limit=400)[0]

    F_s, M_s = (disc(R, lever) - disc(d_i / 2.0, lever) for lever in (lambda s: 1.0, lambda s: s))
    F_1, F_2 = (float(spring.force) for spring in row.springs)
    push = PRESSURE * pi * d_i**2 / 4.0
    assert F_s + F_1 + F_2 == pytest.approx(push, rel=1e-8)
    assert F_1 * 2.0 * R + M_s + F_s * R == pytest.approx(push * R, rel=1e-8)
    assert (row.delta_1 + row.delta_2) / 2.0 == pytest.approx(delta_c, rel=1e-12)
    assert (row.delta_1 - row.delta_2) / (2.0 * R) == pytest.approx(theta, rel=1e-12)
    assert row.curvature == pytest.approx(theta / (L_0 + delta_c), rel=1e-12)


def test_temperature_and_current(solved):
    spring = solved[0].springs[0]
    d, length = float(spring.geometry.wire_diameter), float(spring.geometry.wire_length)
    h = ALLOY["convection"]
    settled = 22.0 + 0.2**2 * 3.5 / (h * pi * d * length)
    time = ALLOY["density"] * ALLOY["heat_capacity"] * d / (4.0 * h)
    found = float(next_temperature(spring.alloy, spring.geometry, 30.0, 0.5, 0.2, 3.5, 22.0))
    assert found == pytest.approx(settled + (30.0 - settled) * np.exp(-0.5 / time), rel=1e-12)
    fraction = 1.0 / (1.0 + np.exp((33.0 - ALLOY["T_mid"]) / ALLOY["T_width"]))
    assert float(spring.alloy.martensite_fraction_at(33.0)) == pytest.approx(fraction, rel=1e-12)


def test_the_arc_of_a_segment():
    theta, length = np.array([0.3, 0.5]), 0.06
    phi = np.hypot(*theta)
    ahead = np.sin(phi) / phi
    end = length * np.array([*(-theta * (1.0 - np.cos(phi)) / phi**2), ahead])
    np.testing.assert_allclose(np.asarray(arc_frame(theta, length))[:3, 3], end, rtol=1e-12)


@pytest.mark.parametrize("page", ["model.md", "corrections.md"])
def test_every_function_that_a_page_names_exists(page):
    packages = "nitinol|silicone|section|actuator|serial_chain"
    names = re.findall(rf"`((?:{packages})\.[\w.]+)`", (ROOT / "docs" / page).read_text())
    assert len(names) > 5
    for name in names:
        found = importlib.import_module(f"pneusma_jax.{name.split('.')[0]}")
        for part in name.split(".")[1:]:
            if not hasattr(found, part):
                found = importlib.import_module(f"{found.__name__}.{part}")
            else:
                found = getattr(found, part)


@pytest.mark.slow
def test_the_examples_of_the_page_run():
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "model.md").read_text(), re.S)
    assert len(blocks) == 2
    found = {}
    exec("\n".join(blocks), found)
    assert list(found["rows"].status) == [0, 0, pj.Status.flattened]
    assert bool(np.all(found["history"].converged)) and bool(found["chain"].converged)
    assert found["history"].rows.curvature[0] != found["history"].rows.curvature[-1]  # it remembers the heat
