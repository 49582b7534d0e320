"""Arrangements as data: coherence between descriptions, turning, explicit places, tables, refusals."""

import dataclasses
import re
from importlib import resources
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from activations import phases

import pneusma_jax as pj
from pneusma_jax.calibration import examples, keys, load_calibration, write_calibration

EXAMPLES = ["orthogonal_pair", "pneuflex_weighed", "rectangular", "semicircular", "triangular"]


def built(arrangement, section=None, **changes):
    geometry = pj.design_geometry("pneusma2", **changes)
    section = pj.annulus(10e-3, 1e-3) if section is None else section
    return pj.build_actuator(section, arrangement, geometry, pj.load_alloy("krl35"), pj.load_silicone())


def turned(angle, vector):
    a = np.radians(angle)
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ np.asarray(vector)


# --- coherence ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_equal_springs_of_a_triad_do_not_bend():
    body = pj.make_actuator("triad")
    largest = 0.0
    for xi0 in (1.0, 0.5, 0.1):
        for pressure in (0.0, 30e3):
            found = pj.solve(body, pressure, phases(xi0, xi0, xi0))
            largest = max(largest, float(jnp.max(jnp.abs(found.bend))) / float(found.length))
    print(f"largest curvature of a triad with equal springs: {largest:.1e} 1/m")
    assert largest < 1e-12


@pytest.mark.slow
def test_a_triad_held_in_a_plane_is_planar():
    """Equal springs 2 and 3: the free triad stays in the plane of spring 1, to which the held one is bound."""
    free = pj.make_actuator("triad")
    held = built(dataclasses.replace(pj.layout("triad"), bending_plane=90.0))
    assert held.basis.shape == (3, 2) and free.basis.shape == (3, 3)
    for xi0 in ((1.0, 0.4, 0.4), (0.3, 0.9, 0.9)):
        one, other = (pj.solve(body, 20e3, phases(*xi0)) for body in (held, free))
        np.testing.assert_allclose(one.bend, other.bend, rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(one.length, other.length, rtol=1e-9)
        assert abs(float(other.bend[0])) < 1e-12 < 0.1 < abs(float(one.curvature))


@pytest.mark.slow
def test_a_held_triad_takes_the_projection_of_what_pulls_aside():
    """Unequal springs 2 and 3: in the plane force and moment balance, across it the plane holds."""
    held = built(dataclasses.replace(pj.layout("triad"), bending_plane=90.0))
    found = pj.solve(held, 20e3, phases(0.9, 0.6, 0.3))
    assert float(found.bend[0]) == 0.0
    from pneusma_jax.actuator.equilibrium import Problem, imbalance

    fresh = tuple(pj.SpringState.fresh(0.1924) for _ in range(3))
    problem = Problem(held, jnp.asarray(20e3), phases(0.9, 0.6, 0.3), fresh)
    force, moment = jax.jit(lambda centre, bend: imbalance(problem, centre, bend))(found.delta_centre, found.bend)
    assert abs(float(force)) < 1e-9 and abs(float(moment[1])) < 1e-11 and abs(float(moment[0])) > 1e-5


@pytest.mark.slow
def test_a_planar_pair_set_free_stays_planar():
    held, free = pj.make_actuator("pneusma2"), built(dataclasses.replace(pj.layout("pneusma2"), bending_plane=None))
    one, other = (pj.solve(body, 25e3, phases(1.0, 0.4)) for body in (held, free))
    np.testing.assert_allclose(other.bend, one.bend, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(other.curvature, one.curvature, rtol=1e-9)


@pytest.mark.parametrize("angle", [30.0, 90.0, 137.0, 240.0])
def test_turning_the_layout_turns_the_answer(angle):
    arrangement, xi0 = pj.layout("triad"), phases(0.8, 0.5, 0.2)
    one = pj.solve(built(arrangement), 20e3, xi0)
    other = pj.solve(built(arrangement.turned(angle)), 20e3, xi0)
    np.testing.assert_allclose(other.bend, turned(angle, one.bend), rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(other.length, one.length, rtol=1e-9)
    np.testing.assert_allclose(other.spring_elongations, one.spring_elongations, rtol=1e-7)


@pytest.mark.slow
def test_turning_a_planar_layout_turns_its_plane():
    arrangement, xi0 = pj.layout("pneusma2"), phases(1.0, 0.3)
    one = pj.solve(built(arrangement), 20e3, xi0)
    for angle in (90.0, 180.0, 205.0):
        other = pj.solve(built(arrangement.turned(angle)), 20e3, xi0)
        np.testing.assert_allclose(other.bend, turned(angle, one.bend), rtol=1e-8, atol=1e-12)
        for what in ("curvature", "delta_1", "delta_2", "printed_curvature"):
            np.testing.assert_allclose(getattr(other, what), getattr(one, what), rtol=1e-8)


def test_alternating_orthogonal_pairs_are_one_layout_turned():
    assert pj.layout("orthogonal_pair") == pj.layout("pneusma2").turned(90.0)


@pytest.mark.slow
def test_an_orthogonal_pair_bends_as_the_layout_that_was_turned():
    pair = pj.make_actuator("orthogonal_pair")
    found, straight = pj.solve(pair, 20e3, phases(1.0, 0.4)), pj.solve(pj.make_actuator("pneusma2"), 20e3, phases(1.0, 0.4))
    np.testing.assert_allclose(found.bend, [-straight.bend[1], 0.0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.curvature, straight.curvature, rtol=1e-9)


@pytest.mark.slow
def test_two_crossed_pairs_on_one_segment_bend_where_they_are_heated():
    crossed = pj.Layout((1, 2, 3, 4), (90.0, 270.0, 0.0, 180.0), bending_plane=None)
    body = built(crossed)
    up = pj.solve(body, 20e3, phases(1.0, 0.4, 1.0, 1.0))
    aside = pj.solve(body, 20e3, phases(1.0, 1.0, 1.0, 0.4))
    np.testing.assert_allclose(aside.bend, [up.bend[1], up.bend[0]], rtol=1e-8, atol=1e-11)
    both = pj.solve(body, 20e3, phases(1.0, 0.4, 1.0, 0.4))
    assert float(both.bend_direction) == pytest.approx(np.pi / 4)


# --- explicit places ----------------------------------------------------------------------------------------


def test_a_place_is_as_good_as_its_angle():
    by_angle, by_place = built(pj.layout("triad")), built(
        pj.Layout((1, 2, 3), (90.0, None, None), bending_plane=None,
                  spring_places=(None, *(np.asarray(p) for p in 5e-3 * np.array([[-np.sqrt(0.75), -0.5], [np.sqrt(0.75), -0.5]]))))
    )  # fmt: skip
    np.testing.assert_allclose(by_place.spring_places, by_angle.spring_places, rtol=1e-12)
    one, other = (pj.solve(body, 20e3, phases(0.8, 0.5, 0.2)).bend for body in (by_angle, by_place))
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_an_angle_means_the_outer_face():
    body = built(pj.Layout((1, 2, 3, 4), (90.0, 0.0, 45.0, 270.0), bending_plane=None), pj.rectangle(12e-3, 8e-3, 1e-3))
    np.testing.assert_allclose(body.spring_places, 1e-3 * np.array([[0, 4], [6, 0], [4, 4], [0, -4]]), atol=1e-15)
    arc = built(pj.Layout((1, 2), (0.0, 90.0)), pj.semicircle(14e-3, 1e-3))
    np.testing.assert_allclose(arc.spring_places, [[np.sqrt(7e-3**2 - 3.5e-3**2), 0.0], [0.0, 3.5e-3]], rtol=1e-12, atol=1e-15)


@pytest.mark.slow
def test_gradient_in_the_places_and_the_section():
    """Curvature and direction of a triad on a rectangular tube, over places and dimensions."""
    alloy, law, geometry = pj.load_alloy("krl35"), pj.load_silicone(), pj.design_geometry("pneusma2", prestrain=0.17)
    fresh = tuple(pj.SpringState.fresh(0.17) for _ in range(3))

    def answer(x):
        places = tuple(x[2 * k : 2 * k + 2] for k in range(3))
        arrangement = pj.Layout((1, 2, 3), (None,) * 3, bending_plane=None, spring_places=places)
        body = pj.build_actuator(pj.rectangle(x[6], x[7], x[8]), arrangement, geometry, alloy, law)
        return pj.solve(body, 20e3, phases(0.8, 0.55, 0.35), fresh).bend

    x = 1e-3 * jnp.asarray([0.5, 4.2, -5.0, -2.0, 5.5, -3.0, 12.0, 8.0, 1.0])
    # one program for the gradient and the points of a fourth-order difference
    slopes = jax.jit(jax.vmap(jax.value_and_grad(lambda x: answer(x) @ jnp.asarray([0.6, 0.8]))))
    e = 2e-7 * jnp.eye(9)
    values, gradients = slopes(jnp.concatenate([x[None], x + e, x - e, x + 2 * e, x - 2 * e]))
    near, mirrored, far, far_mirrored = values[1:].reshape(4, -1)
    numeric = (8 * (near - mirrored) - (far - far_mirrored)) / (12 * 2e-7)
    exact = np.asarray(gradients[0])
    assert np.all(np.isfinite(exact)) and np.all(np.abs(exact) > 1.0)
    np.testing.assert_allclose(exact, numeric, rtol=1e-6, atol=1e-5 * np.abs(exact).max())


# --- tables -------------------------------------------------------------------------------------------------


def test_what_examples_are_shipped():
    assert examples() == EXAMPLES


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_round_trip_and_balance(name, tmp_path):
    table = load_calibration(name)
    assert table.name == name and table.description and table.kind == "actuator"
    copy = tmp_path / "mine.toml"
    write_calibration(table, copy)
    assert load_calibration(copy) == table
    body, again = pj.make_actuator(name), pj.make_actuator(copy)
    for one, other in zip(jax.tree.leaves(body), jax.tree.leaves(again), strict=True):
        np.testing.assert_array_equal(one, other)
    xi0 = phases(1.0, 0.4, 0.7)[: len(body.springs)]
    found = pj.solve(body, 15e3, xi0)
    assert np.isfinite(float(found.length)) and float(found.bend_magnitude) > 0.1


def shipped(name):
    return resources.files("calibration_data").joinpath("examples", "designs", f"{name}.toml").read_text(encoding="utf-8")


def test_named_dimensions_change():
    body = pj.make_actuator("rectangular", height=9e-3, width=13e-3, length=60e-3)
    np.testing.assert_allclose([body.section.radius, body.length, body.springs[0].attached_length], [4.5e-3, 60e-3, 60e-3])
    np.testing.assert_allclose(body.section.enclosed_area, 7e-3 * 11e-3)
    with pytest.raises(pj.InputError, match="'heigth' is not a dimension of this actuator: did you mean 'height'"):
        pj.make_actuator("rectangular", heigth=9e-3)
    with pytest.raises(pj.InputError, match="'width' is not a dimension"):
        pj.make_actuator("pneusma2", width=9e-3)


def test_materials_beside_the_table_and_given_ones(tmp_path):
    alloy = load_calibration("krl45")
    write_calibration(dataclasses.replace(alloy, name="mine"), tmp_path / "mine.toml")
    path = tmp_path / "body.toml"
    path.write_text(shipped("rectangular").replace('alloy = "krl35"', 'alloy = "mine.toml"'), encoding="utf-8")
    assert pj.make_actuator(path).springs[0].alloy.name == "mine"
    assert pj.make_actuator(str(path), "krl35").springs[0].alloy.name == "krl35"


def test_bending_is_free_where_something_lies_outside_the_plane(tmp_path):
    def plane(name, *changes):
        text = shipped(name)
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "mine.toml"
        path.write_text(text, encoding="utf-8")
        return pj.make_actuator(path).bending_plane

    mm = 'unit = "mm", status = "assumed", source = "x"}'
    place = f'x_2 = {{value = 1.0, {mm}\ny_2 = {{value = -4.0, {mm}\nwidth ='
    aside = 'tip_force_x = {value = 10.0, unit = "mN", status = "assumed", source = "x"}\nwidth ='
    assert plane("rectangular") == 90.0
    assert plane("rectangular", ("width =", place)) is None
    assert plane("rectangular", ("width =", aside)) is None
    assert plane("rectangular", ("side_1", 'bending = "free"\nside_1')) is None
    assert plane("rectangular", ("width =", place), ("side_1", 'bending = "planar"\nside_1')) == 90.0
    assert plane("orthogonal_pair") == 180.0


def test_the_page_names_every_key_and_its_example_builds():
    page = (Path(__file__).parents[2] / "docs" / "actuators.md").read_text(encoding="utf-8")
    table = "\n".join(line for line in page.splitlines() if line.startswith("| `"))
    table = re.sub(r"`side_1` to `side_8`", " ".join(f"`{side}`" for side in keys.SIDES), table)
    for stem in ("x", "y", "angle"):
        table = table.replace(f"`{stem}_K`", " ".join(f"`{stem}_{k}`" for k in range(1, len(keys.SIDES) + 1)))
    named = set(re.findall(r"`(\w+)`", table))
    known = {*keys.QUANTITIES["actuator"], *keys.TEXT["actuator"], *keys.OUTLINES["actuator"]}
    assert known - named == {"description", "citation"}
    blocks = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    scope = {"pj": pj}
    exec(blocks[1], scope)
    assert len(scope["body"].springs) == 4 and len(scope["body"].loads) == 2
    for name in re.findall(r"`(\w+)`", page.partition("Shipped to use:")[2].partition("## Axes")[0]):
        assert load_calibration(name, "actuator").name == name


# --- refusals -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arrangement", "what"),
    [
        (pj.Layout((1, 2), (90.0, 95.0)), "Springs 1 and 2 overlap: their centres are 0.436 mm apart, but their coils are 1.4 mm wide"),
        (pj.Layout((1,), (None,), spring_places=(np.array([0.0, 9e-3]),)), r"Spring 1 must lie at the wall, at most 1.4 mm away, but \(0, 9\) mm is 4 mm from it"),
        (pj.Layout((2,), (None,), spring_places=(np.array([0.0, 0.0]),)), r"Spring 2 must lie at the wall, .* \(0, 0\) mm is 4 mm from it"),
        (pj.Layout((), (), fibre_place=np.array([0.0, 2e-3])), r"The fibre must lie at the wall, at most 0.5 mm away"),
    ],
)  # fmt: skip
def test_springs_that_cannot_be_there_are_refused(arrangement, what):
    with pytest.raises(ValueError, match=what) as error:
        built(arrangement)
    assert "\n" not in str(error.value)


def test_a_spring_inside_the_bore_at_the_wall_is_accepted():
    inside = np.array([0.0, -3.3e-3])
    body = built(pj.Layout((1, 2, 3), (None, 30.0, 150.0), bending_plane=None, spring_places=(inside, None, None)))
    np.testing.assert_array_equal(body.spring_places[0], inside)
    assert float(pj.solve(body, 10e3, phases(0.4, 1.0, 1.0)).curvature) > 0.0


def test_a_ray_without_wall_is_refused():
    moved = pj.polygon(1e-3 * np.array([[4, -3], [10, -3], [10, 3], [4, 3]]), 0.5e-3)
    with pytest.raises(ValueError, match="at 180 degrees needs a wall there"):
        built(pj.Layout((1,), (180.0,)), moved)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: pj.Layout((1, 2), (90.0,)), "one angle or place per spring, 2 here, but it has 1 angles"),
        (lambda: pj.Layout((1,), (None,)), "Spring 1 must have either an angle or a place"),
        (lambda: pj.Layout((1,), (90.0,), spring_places=(np.zeros(2),)), "Spring 1 must have either an angle or a place"),
        (lambda: pj.Layout(fibre_angle=90.0, fibre_place=np.zeros(2)), "fibre must have either an angle or a place"),
    ],
)
def test_layouts_that_contradict_themselves_are_refused(make, what):
    with pytest.raises(ValueError, match=what):
        make()


def number(key, value, unit):
    return f'{key} = {{value = {value}, unit = "{unit}", status = "assumed", source = "x"}}\n'


@pytest.mark.parametrize(
    ("name", "old", "new", "what"),
    [
        ("rectangular", '"rectangle"', '"rectangel"', "section is 'rectangel', did you mean 'rectangle'?"),
        ("rectangular", "height =", "hight =", "unknown key 'hight', did you mean 'height'?"),
        ("rectangular", '"rectangle"', '"semicircle"', "key 'outer_diameter' is missing"),
        ("semicircular", "outer_diameter", number("width", 3.0, "mm") + "outer_diameter", "key 'width' is of section 'rectangle', but section is 'semicircle'"),
        ("triangular", "outer_line", "outer_lin", "unknown key 'outer_lin', did you mean 'outer_line'?"),
        ("triangular", "outer_line", "bore_line", "key 'outer_line' is missing"),
        ("triangular", "[0.8, -6.5]", "[0.8]", "key 'outer_line': point 2 must be \\[x, y\\], but it is \\[0.8\\]"),
        ("triangular", "[0.8, -6.5]", '[0.8, "a"]', "key 'outer_line': point 2 must be a finite number"),
        ("triangular", '"polygon"', '"annulus"', "key 'outer_diameter' is missing"),
        ("triangular", "wall_thickness =", "width =", "key 'width' is of section 'rectangle'"),
        ("rectangular", 'side_1 =', 'side_7 = "spring"\nside_1 =', "side_7 needs 'angle_7', or 'x_7' and 'y_7'"),
        ("rectangular", "width =", number("x_1", 1.0, "mm") + "width =", "side_1 needs either 'angle_1', or both 'x_1' and 'y_1'"),
        ("rectangular", "width =", number("angle_3", 1.0, "deg") + "width =", "key 'angle_3' places 'side_3', where nothing is"),
        ("rectangular", '"spring"', '"fibre"', "more than one side is a 'fibre'"),
        ("rectangular", "width =", number("tip_mass", 1.0, "g") + "width =", "'tip_mass' weighs nothing without gravity"),
        ("rectangular", "width =", number("tip_x", 1.0, "mm") + "width =", "needs both 'tip_x' and 'tip_y'"),
        ("pneuflex_weighed", "tip_mass =", number("gravity_z", -9.8, "m/s2") + "tip_mass =", "'orientation' and 'gravity_z' both say"),
        ("pneuflex_weighed", "vertical_base_down", "vertical_base_dwn", "orientation is 'vertical_base_dwn', did you mean 'vertical_base_down'?"),
        ("orthogonal_pair", "side_1 =", 'bending = "free"\nside_1 =', "bending is 'free', so there can be no 'bending_plane'"),
        ("orthogonal_pair", "side_1 =", 'bending = "planer"\nside_1 =', "bending is 'planer', did you mean 'planar'?"),
    ],
)  # fmt: skip
def test_refusals_of_a_description(name, old, new, what, tmp_path):
    text = shipped(name)
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(pj.InputError, match=f"^{re.escape(str(path))}: .*{what}") as error:
        load_calibration(path)
    assert "\n" not in str(error.value)


def test_an_unknown_example_is_refused_with_the_nearest():
    with pytest.raises(pj.InputError, match="no table of constants is called 'rectangle', did you mean 'rectangular'?"):
        pj.make_actuator("rectangle")


def test_impossible_geometry_of_a_file_names_the_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(shipped("orthogonal_pair").replace('angle_2 = {value = 0.0', 'angle_2 = {value = 181.0'), encoding="utf-8")
    with pytest.raises(pj.InputError, match=f"^{re.escape(str(path))}: Springs 1 and 2 overlap"):
        pj.make_actuator(path)


def test_known_dimensions_are_checked_in_a_traced_function_too():
    """Operations on known numbers become part of a traced program; the check must see the numbers."""
    silicone, alloy, layout = pj.load_silicone(), pj.load_alloy("krl35"), pj.layout("pneusma2")

    def scaled(attached):
        geometry = pj.design_geometry("pneusma2", attached_length=attached)

        def length(factor):
            stiffer = dataclasses.replace(alloy, G_m=factor * alloy.G_m)
            body = pj.build_actuator(pj.annulus(10e-3, 1e-3), layout, geometry, stiffer, silicone)
            return factor * body.length

        return jax.jit(length)(2.0)

    assert float(scaled(50e-3)) == pytest.approx(2.0 * float(pj.design_geometry("pneusma2").length))
    with pytest.raises(ValueError, match="attached_length.*mm of wire"):
        scaled(10.0)
