"""Agreement with an independent implementation (2-D quadrature, SciPy root finding): 1e-8, equilibria 1e-6."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.nitinol import geometry
from pneusma_jax.silicone import NeoHookean


@pytest.fixture(scope="module")
def oracle(shared):
    return json.loads((shared / "oracle" / "model.json").read_text())


def agree(ours, theirs, relative=1e-8):
    np.testing.assert_allclose(np.asarray(ours, float), np.asarray(theirs, float), rtol=relative, atol=1e-9)


def test_geometry(oracle):
    o = oracle["geometry"]
    spring = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    agree(geometry.spring_index(spring.coil_diameter, spring.wire_diameter), o["spring_index"])
    agree(geometry.wahl_factor(4.6), o["wahl"])
    agree(spring.shear_strain(jnp.asarray(o["spring_strain"]) * 14e-3), o["shear_strain"])
    agree(spring.wire_length, o["wire_length_52_coils_m"])
    agree(spring.force(1e8), o["force_at_100MPa_N"])
    true = oracle["true_helix_shear_strain"]
    strain = jnp.asarray(true["spring_strain"])
    agree(geometry.shear_strain(strain, 0.269e-3, 1.15e-3, 0.25e-3, helix="true"), true["shear_strain"])


@pytest.mark.parametrize("name", ["krl35", "krl45"])
def test_alloy(oracle, name):
    o, alloy = oracle[name], pj.load_alloy(name)
    gamma, xi0 = jnp.asarray(o["gamma"]), jnp.asarray(o["xi0"])[:, None]
    virgin = -1.0  # so far below that the loading curve always decides

    @jax.jit
    def laws(gamma, xi0):
        stretched = alloy.residual_strain(pj.SpringState.fresh(0.1924), xi0)
        return {
            **{key: getattr(alloy, key)(gamma) for key in ("xi_sm", "xi_sa", "rho_m", "rho_a")},
            "resistivity": alloy.resistivity(xi0, gamma),
            "stress_virgin_Pa": alloy.shear_stress(gamma, xi0, virgin),
            "stress_after_prestrain_0p1924_Pa": alloy.shear_stress(gamma, xi0, stretched),
        }

    for key, found in laws(gamma, xi0).items():
        agree(found, o[key])


def test_residual_strain(oracle):
    o, alloy = oracle["residual"], pj.load_alloy("krl35")
    agree(alloy.residual_strain_limit(jnp.asarray(o["prestrain"], float)), o["gamma_R_max"])
    agree(alloy.residual_strain(pj.SpringState.fresh(0.1924), 0.4), o["at_xi0_0p4"])


def test_silicone_and_section(oracle):
    law = pj.load_silicone()
    agree(jax.jit(lambda x: law(x))(jnp.asarray(oracle["silicone"]["strain"])), oracle["silicone"]["stress_Pa"])
    neo = oracle["neo_hookean_engineering"]
    agree(NeoHookean(neo["mu_Pa"])(jnp.asarray(neo["stretch"]) - 1.0), neo["stress_Pa"])
    section, length = pj.annulus(10e-3, 1e-3), 56e-3
    integrate = jax.jit(lambda centre, gradient: section.integrate(law, centre, gradient))
    for row in oracle["section_10mm_1mm"]:
        centre = (row["delta1"] + row["delta2"]) / (2.0 * length)
        gradient = jnp.asarray([0.0, (row["delta1"] - row["delta2"]) / (10e-3 * length)])
        force, moment = integrate(centre, gradient)
        agree(force, row["force_N"])
        agree(moment[1] + force * 5e-3, row["moment_Nm"])


def same_equilibrium(found, row):
    assert bool(found.converged)
    agree(found.delta_1, row["delta1_m"], 1e-6)
    agree(found.delta_2, row.get("delta2_m", 0.0), 1e-6)
    agree(found.curvature, row["curvature_1pm"], 1e-6)
    if "length_m" in row:
        agree(found.length, row["length_m"], 1e-6)
        agree(found.bend_angle, row["bend_angle_rad"], 1e-6)
        agree(found.printed_curvature, row["curvature_printed_1pm"], 1e-6)


def test_equilibria(oracle):
    bodies = {design: pj.make_actuator(design) for design in ("pneusma1", "pneusma2")}
    for row in oracle["equilibrium_krl35"]:
        body = bodies[row["design"]]
        phases = tuple(pj.MartensiteFraction(row[f"xi0_{k}"]) for k in body.spring_numbers)
        same_equilibrium(pj.solve(body, row["pressure_Pa"], phases), row)


def test_equilibria_from_resistance(oracle):
    bodies = {alloy: pj.make_actuator("pneusma2", alloy) for alloy in ("krl35", "krl45")}
    for row in oracle["equilibrium_from_resistance"]:
        measured = (pj.MartensiteFraction(row["xi0_1"]), pj.Resistance(row["resistance_2_ohm"]))
        found = pj.solve(bodies[row["alloy"]], row["pressure_Pa"], measured)
        same_equilibrium(found, row)
        agree(found.springs[1].xi0, row["solution_xi0_2"], 1e-6)
        agree(found.springs[0].gamma_R, row["gamma_R_1"], 1e-6)
        agree(found.springs[1].gamma_R, row["gamma_R_2"], 1e-6)


def test_inextensible_limit(oracle):
    for row in oracle["pneuflex_inextensible"]:
        same_equilibrium(pj.solve(pj.make_actuator(row["design"]), row["pressure_Pa"]), row)


def test_every_equilibrium_in_one_batch(oracle):
    rows = [row for row in oracle["equilibrium_krl35"] if row["design"] == "pneusma2"]
    column = lambda key: jnp.asarray([row[key] for row in rows])  # noqa: E731
    phases = tuple(pj.MartensiteFraction(column(f"xi0_{k}")) for k in (1, 2))
    found = pj.solve_batch(pj.make_actuator("pneusma2"), column("pressure_Pa"), phases)
    agree(found.curvature, column("curvature_1pm"), 1e-6)
    assert jax.device_get(found.status).tolist() == [0] * len(rows)
