"""A laboratory's test plans: recordings, roles, assumptions and instruments of a campaign of each kind."""

import numpy as np

from . import numbers as published
from .bench import Bench, Take
from .protocols import Heater, chatter, step_and_hold, triangles, way

FLAVOURS = ("white", "ar1", "heteroscedastic", "drift", "blind")


def _roles(rng, count, masked):
    """Roles of recordings. Usually one or more are for validation; the last one of a masked campaign is."""
    held = {count - 1} if masked else {int(rng.integers(1, count))}
    if not masked and count > 4 and rng.random() < 0.4:
        held.add(int(rng.integers(1, count)))
    return ["validation" if k in held else "fit" for k in range(count)]


def _takes(rng, stem, plans, masked=False):
    """Takes of one campaign from a list of (time, drives); some lose their last rows."""
    roles = _roles(rng, len(plans), masked)
    out = []
    for k, (time, drive) in enumerate(plans):
        rows = len(time) - int(rng.integers(0, len(time) // 10 + 1)) if rng.random() < 0.4 else len(time)
        out.append(Take(f"{stem}_{k + 1}", roles[k], time, drive, max(rows, 100)))
    return out


def _clock(count, seconds):
    return np.linspace(0.0, seconds, count)


def plan_elastomer(rng, flavour, masked):
    """Coupons pulled in triangles at several rates, with holds."""
    count = int(rng.integers(130, 200))
    high = rng.uniform(0.7, 0.95) if not masked else 0.45
    slow, fast = rng.uniform(400, 900), rng.uniform(25, 60)
    shapes = [
        (triangles([0.85 * high, 0.85 * high], count), slow),
        (triangles([0.4 * high, 0.7 * high, high], count, valley=0.0), 0.6 * slow),
        (triangles([0.9 * high, 0.9 * high], count), fast),
        (step_and_hold(0.8 * high, count, rng.uniform(0.03, 0.1)), 0.7 * slow),
        (triangles([0.6 * high, high], count, valley=0.2 * high), rng.uniform(100, 200)),
    ][: int(rng.integers(4, 6))]
    if masked:
        shapes[-1] = (triangles([0.6, 0.95], count), rng.uniform(30, 90))
    plans = [(_clock(count, seconds), {"strain": shape}) for shape, seconds in shapes]
    nominal = {"silicone_stiffness": 1.0}
    return Bench("elastomer", _takes(rng, "pull", plans, masked), nominal, {"silicone_stiffness": 0.05},
                 {"stress_kPa": float(rng.choice([0.15, 0.25, 0.4]))}, flavour, specimen="E", drives=("strain",),
                 inputs=("strain",), outputs=("stress_kPa",))  # fmt: skip


def plan_tube(rng, flavour, masked):
    """A tube inflated in ramps at several rates, with holds."""
    count = int(rng.integers(120, 180))
    high = rng.uniform(38, 48) if not masked else 24.0
    slow, fast = rng.uniform(250, 400), rng.uniform(30, 60)
    shapes = [
        (triangles([0.7 * high, 0.7 * high], count), 0.4 * slow),
        (triangles([high, high], count), fast),
        (triangles([0.4 * high, 0.7 * high, high], count), slow),
        (step_and_hold(0.85 * high, count, rng.uniform(0.03, 0.1)), 0.7 * slow),
        (triangles([0.5 * high, 0.9 * high], count, valley=0.2 * high), 0.5 * slow),
    ][: int(rng.integers(4, 6))]
    if masked:
        shapes[-1] = (triangles([30.0, 46.0], count), fast)
    plans = [(_clock(count, seconds), {"pressure_kPa": shape}) for shape, seconds in shapes]
    tolerance = {"silicone_stiffness": 0.05}
    if rng.random() < 0.6:
        tolerance["wall_thickness_mm"] = 0.03
    geometry = {k: published.TUBE[k] for k in ("outer_diameter_mm", "wall_thickness_mm", "length_mm")}
    return Bench("tube", _takes(rng, "inflation", plans, masked), dict(published.TUBE), tolerance,
                 {"length_mm": float(rng.choice([0.03, 0.05, 0.08])), "pressure_kPa": 0.05}, flavour,
                 geometry=geometry, specimen="T", drives=("pressure_kPa",), inputs=("pressure_kPa",),
                 outputs=("length_mm",))  # fmt: skip


def _level(rng, count, level, amount=0.012):
    """A martensite fraction that a controller holds: it settles after a transient and ripples."""
    x = np.arange(count)
    settle = 0.12 * (1.0 - level) * np.exp(-x / rng.uniform(7, 15)) * np.cos(x / rng.uniform(5, 10))
    ripple = amount * min(1.0, 6.0 * (1.0 - level)) * chatter(rng, count, rng.uniform(18, 40))
    return np.clip(level + settle + ripple, 0.02, 1.0)


def plan_spring(rng, flavour, masked):
    """Pulls of one spring at held resistances, and a thermal cycle at fixed length."""
    count = int(rng.integers(130, 190))
    hot = 0.12 if flavour == "blind" else 0.32
    far = rng.uniform(55, 75) if not masked else 30.0
    levels = [1.0, rng.uniform(0.75, 0.9), rng.uniform(0.5, 0.65), rng.uniform(hot, hot + 0.1), rng.uniform(0.6, 0.8)]
    alloy = "krl35" if rng.random() < 0.75 else "krl45"
    heater = Heater(rng, published.ALLOYS[alloy]["T_mid"], published.ALLOYS[alloy]["T_width"])
    plans = []
    for number, level in enumerate(levels[: int(rng.integers(4, 6))]):
        reach = far * (1.0 if number in (0, 4) else rng.uniform(0.6, 0.8))
        peaks = [0.5 * reach, reach] if number % 2 else [reach]
        if masked and number == 3:
            peaks = [40.0, 70.0]
        seconds = float(rng.choice([150.0, 300.0, 60.0]))
        xi0 = np.ones(count) if level == 1.0 else _level(rng, count, level)
        plans.append((_clock(count, seconds), {"elongation_mm": triangles(peaks, count), "xi0": xi0}))
    if not masked and rng.random() < 0.7:
        length = rng.uniform(15, 40)
        stretch = way([0, 0.12, 0.9, 1], [0, length, length, 0], count)
        shape = way([0, 0.15, 0.45, 0.65, 0.9, 1], [0, 0, 1, 1, 0, 0], count)
        time = _clock(count, 120.0)
        xi0 = heater.cycle(rng, time, shape, hot + 0.05)[2]
        plans.append((time, {"elongation_mm": stretch, "xi0": xi0}))
    for _, drive in plans:
        share = np.clip(drive["xi0"], 1e-3, 0.9995)
        temperature = heater.middle + heater.width * np.log(1.0 / share - 1.0)
        drive["temperature_degC"] = temperature
        drive["current_A"] = heater.current_for(temperature)
    tolerance = {"G_m": 0.05, "G_a": 0.05}
    if rng.random() < 0.5:
        tolerance["gamma_L"] = 0.03
    if rng.random() < 0.5:
        tolerance |= {"rho_mean": 0.003, "alpha_1": 0.003}
    geometry = {"alloy": alloy, "active_coils": 52.0, "free_length_mm": 14.0, "prestrain": 0.0}
    return Bench("spring", _takes(rng, "test", plans, masked), published.ALLOYS[alloy] | published.SPRING, tolerance,
                 {"force_N": float(rng.choice([0.003, 0.004, 0.006])), "resistance_ohm": float(rng.choice([2e-4, 4e-4]))},
                 flavour, geometry=geometry, specimen="S", drives=("elongation_mm", "xi0", "temperature_degC", "current_A"),
                 inputs=("elongation_mm", "resistance_ohm"), outputs=("force_N",),
                 extra=("temperature_degC", "current_A") if rng.random() < 0.3 else ())  # fmt: skip


def plan_wire(rng, flavour, masked):
    """Thermal cycles of a wire under constant stresses; some partial, some in steps of stress."""
    count = int(rng.integers(140, 200))
    middle = published.NITI_WIRE["T_mid"]
    stresses = rng.permutation(np.array([60.0, 100.0, 140.0, 180.0, 220.0]))[: int(rng.integers(4, 6))]
    if masked:
        stresses = np.array([110.0, 125.0, 140.0, 40.0])
    plans = []
    for number, stress in enumerate(stresses):
        hot, cold = middle + rng.uniform(38, 48), middle - rng.uniform(30, 40)
        peaks = [hot, cold, hot] if number % 3 else [hot, cold, middle + rng.uniform(0, 6), cold + 8, hot]
        if masked:
            peaks = [hot, cold, middle - 2.0, cold + 4, hot] if number == 3 else [hot, cold, hot]
        corners = np.concatenate([[0], np.cumsum(np.abs(np.diff(peaks)))])
        temperature = way(corners / corners[-1], peaks, count)
        temperature = temperature + 0.35 * chatter(rng, count, rng.uniform(20, 40))
        load = np.full(count, stress)
        if number == 1 and not masked:
            load = stress + way([0, 0.3, 0.5, 0.8, 1], [0, 0, 25, 25, 0], count)
        plans.append((_clock(count, rng.uniform(400, 900)), {"temperature_degC": temperature, "stress_MPa": load}))
    tolerance = {"E_m": 0.05, "E_a": 0.05, "eps_L": 0.03, "T_mid": 0.03, "T_width": 0.1}
    if rng.random() < 0.5:
        tolerance |= {"beta_2": 0.02}
    return Bench("wire", _takes(rng, "cycle", plans, masked), dict(published.NITI_WIRE), tolerance,
                 {"strain": float(rng.choice([1e-4, 2e-4])), "temperature_degC": 0.1}, flavour,
                 geometry={"alloy": "niti_wire", "prestrain": 0.0}, specimen="W", drives=("stress_MPa", "temperature_degC"),
                 inputs=("stress_MPa", "temperature_degC"), outputs=("strain",))  # fmt: skip


def _heat_cycle(rng, heater, count, pressure, coldest):
    time = 0.5 * np.arange(count)
    shape = way([0, 0.08, 0.4, 0.58, 0.6, 1], [0, 0, 1, 1, 0, 0], count, hold_jitter=0.3, rng=rng)
    current, temperature, xi0 = heater.cycle(rng, time, shape, coldest)
    return time, dict(pressure_kPa=np.full(count, pressure), current_2_A=current, hot_degC=temperature, xi0_2=xi0)


def _pressure_sweep(rng, heater, count, low, high, coldest):
    time = 0.5 * np.arange(count)
    shape = way([0, 0.04, 0.15, 0.96, 1], [0, 0, 1, 1, 0.9], count)
    current, temperature, xi0 = heater.cycle(rng, time, shape, coldest)
    pressure = low + (high - low) * way([0, 0.25, 0.6, 0.95, 1], [0, 0, 1, 0, 0], count, hold_jitter=0.3, rng=rng)
    return time, dict(pressure_kPa=pressure, current_2_A=current, hot_degC=temperature, xi0_2=xi0)


def _regulated(rng, pressure):
    """A pressure regulator's ripple."""
    return pressure + 0.08 * chatter(rng, len(pressure), rng.uniform(20, 40))


def plan_actuator(rng, flavour, masked, design=None, springs=False):
    """Heat-cool cycles at held pressures, and pressure sweeps at held heat; `springs` is true for a design
    with springs."""
    count = int(rng.integers(130, 180))
    if design is None:
        design = str(rng.choice(["pneusma2", "pneusma1", "pneuflex_s"], p=[0.6, 0.33, 0.07]))
    if springs and design == "pneuflex_s":
        design = "pneusma2"
    heater = Heater(rng)
    hot = rng.uniform(0.1, 0.16) if flavour == "blind" else rng.uniform(0.35, 0.5)
    mild = 0.6 if masked else hot
    plans = [
        _heat_cycle(rng, heater, count, rng.uniform(10, 18), mild),
        _heat_cycle(rng, heater, count, rng.uniform(25, 34), mild + 0.05),
        _pressure_sweep(rng, heater, count, 8.0, 30.0 if masked else 45.0, mild + 0.15),
        _pressure_sweep(rng, heater, count, 8.0, 30.0 if masked else rng.uniform(35, 45), mild),
        _heat_cycle(rng, heater, count, rng.uniform(18, 25), mild + 0.1),
        _pressure_sweep(rng, heater, count, 8.0, 40.0, 0.97),
    ]
    order = rng.permutation(6)[: int(rng.integers(4, 7))] if not masked else [0, 1, 2, 5]
    plans = [plans[k] for k in order]
    if masked:
        plans.append(_heat_cycle(rng, heater, count, rng.uniform(8, 14), hot))
    for _, drive in plans:
        drive["pressure_kPa"] = _regulated(rng, drive["pressure_kPa"])
        drive["xi0_1"] = np.ones(count)
    alloy = "krl35" if rng.random() < 0.85 else "krl45"
    tolerance = {"wall_thickness_mm": 0.03, "G_m": 0.05, "G_a": 0.05, "silicone_stiffness": 0.05}
    if rng.random() < 0.4:
        tolerance["gamma_L"] = 0.03
    if rng.random() < 0.3:
        tolerance |= {"rho_mean": 0.002, "alpha_1": 0.002}
    sizes = {k: published.TUBE[k] for k in ("outer_diameter_mm", "wall_thickness_mm", "length_mm")}
    geometry = {"design": design} | sizes
    springs = design != "pneuflex_s"
    if springs:
        geometry |= {"alloy": alloy, "active_coils": 52.0, "free_length_mm": 14.0, "prestrain": 0.1924}
    else:
        tolerance = {k: tolerance[k] for k in ("wall_thickness_mm", "silicone_stiffness")}
    geometry["orientation"] = str(rng.choice(["vertical_base_down", "vertical_base_up"], p=[0.75, 0.25]))
    noise = {"curvature_1pm": float(rng.choice([0.2, 0.25, 0.35])), "pressure_kPa": 0.05}
    inputs, extra, outputs = ("pressure_kPa",), (), ("curvature_1pm",)
    if springs:
        noise["resistance_2_ohm"] = 5e-4 if flavour == "blind" else float(rng.choice([1.5e-4, 3e-4]))
        inputs += ("resistance_2_ohm",)
        extra = ("current_2_A",) if rng.random() < 0.7 else ()
    if rng.random() < 0.3:
        outputs += ("length_mm",)
        noise["length_mm"] = 0.15
    if rng.random() < 0.1:
        outputs = ("bend_angle_deg",) + outputs[1:]
        noise["bend_angle_deg"] = 1.0
        del noise["curvature_1pm"]
    return Bench("actuator", _takes(rng, "run", plans, masked), published.ALLOYS[alloy] | published.SPRING | published.TUBE,
                 tolerance, noise, flavour, geometry=geometry, specimen="A",
                 drives=("pressure_kPa", "current_2_A", "hot_degC", "xi0_2", "xi0_1"), inputs=inputs, outputs=outputs,
                 extra=extra)  # fmt: skip


PLANS = {"elastomer": plan_elastomer, "tube": plan_tube, "spring": plan_spring, "wire": plan_wire,
         "actuator": plan_actuator}  # fmt: skip


def plan(kind, rng, *, masked=False, flavour=None, blind=0.15, **options):
    """Bench of a kind. `masked` keeps the fitted recordings in a narrow range that validation leaves. `blind`
    is the share of campaigns in which the resistance of a hot spring is uninformative."""
    if flavour is None:
        blind = blind if kind in ("actuator", "spring") else 0.0
        weights = np.array([0.35, 0.3, 0.2, 0.15, blind / (1.0 - blind)]) * (1.0 - blind)
        flavour = str(rng.choice(FLAVOURS, p=weights))
    bench = PLANS[kind](rng, flavour, masked, **options)
    bench.noise_stated = bool(rng.random() < 0.85)
    return bench


def true_numbers(bench, rng):
    """True constants of the specimen: nominal ones, with those that have a tolerance drawn within it."""
    out = dict(bench.nominal)
    for name in sorted(bench.tolerance):
        draw = np.clip(rng.standard_normal(), -2.5, 2.5)
        out[name] = bench.nominal[name] * (1.0 + bench.tolerance[name] * draw)
    return out
