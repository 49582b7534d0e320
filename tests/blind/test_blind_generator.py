"""The blind trial's generator: independent, in agreement with the published base, repeatable, sealed."""

import ast
import hashlib
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from validation.blind import cases as blind_cases
from validation.blind.cases import Case, case_list, write_case
from validation.blind.generator import actuator, nitinol, numbers, registry, section, silicone, stand
from validation.blind.generator.bench import Bench, Take
from validation.blind.generator.building import Specimen, build
from validation.blind.generator.hidden import HiddenJudge
from validation.blind.generator.plans import PLANS, plan, true_numbers
from validation.blind.generator.readout import READOUTS, read_out
from validation.blind.seal import open_seals, seal

HERE = Path(blind_cases.__file__).parent
ROWS = {"actuator": "pressure_kPa", "spring": "elongation_mm", "wire": "temperature_degC", "elastomer": "strain", "tube": "pressure_kPa"}


@pytest.fixture(scope="module")
def oracle(shared):
    return json.loads((shared / "oracle" / "model.json").read_text())


def test_it_shares_no_code_with_the_tool():
    allowed = {"numpy", "scipy", "collections", "dataclasses", "pathlib", "hashlib", "json", "shutil", "validation"}
    for path in [*HERE.glob("generator/*.py"), HERE / "cases.py", HERE / "seal.py"]:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            assert {n.split(".")[0] for n in names} <= allowed, f"{path.name} imports {names}"
            assert not (isinstance(node, ast.Name) and node.id in ("__import__", "importlib", "exec", "eval")), path.name


@pytest.mark.parametrize("alloy", ["krl35", "krl45"])
def test_nitinol_agrees_with_independent_values(oracle, alloy):
    q, known = numbers.ALLOYS[alloy] | numbers.SPRING, oracle[alloy]
    gamma, xi0 = np.array(known["gamma"]), np.array(known["xi0"])[:, None]
    np.testing.assert_allclose(nitinol.detwinned(q, gamma), known["xi_sm"], rtol=1e-9)
    np.testing.assert_allclose(nitinol.stress_induced(q, gamma), known["xi_sa"], rtol=1e-9)
    np.testing.assert_allclose(nitinol.resistivity(q, xi0, gamma), known["resistivity"], rtol=1e-9)
    memory = nitinol.Memory(q, (5, 8), 0.1924)
    np.testing.assert_allclose(memory.stress(gamma, xi0), known["stress_after_prestrain_0p1924_Pa"], rtol=1e-8, atol=1e-2)
    inside = gamma > 0  # at no strain a power of less than one is steep in rounding
    back = nitinol.fraction_from_resistivity(q, nitinol.resistivity(q, xi0, gamma), gamma)
    np.testing.assert_allclose(back[:, inside], np.broadcast_to(xi0, back.shape)[:, inside], atol=1e-6)


def test_spring_geometry_and_silicone_agree_with_independent_values(oracle):
    q, known = numbers.KRL35 | numbers.SPRING, oracle["geometry"]
    np.testing.assert_allclose(nitinol.shear_strain(q, np.array(known["spring_strain"])), known["shear_strain"], rtol=1e-10)
    assert nitinol.wire_length(q) == pytest.approx(known["wire_length_52_coils_m"], rel=1e-12)
    assert 1e8 * nitinol.force_per_stress(q) == pytest.approx(known["force_at_100MPa_N"], rel=1e-12)
    stress = silicone.base_stress(np.array(oracle["silicone"]["strain"]))
    np.testing.assert_allclose(stress, oracle["silicone"]["stress_Pa"], rtol=1e-10)


def test_the_section_agrees_with_independent_values(oracle):
    tube = section.Annulus({k: np.array([v]) for k, v in numbers.TUBE.items()}, around=600)
    for known in oracle["section_10mm_1mm"]:
        strain = (known["delta2"] + tube.height / 0.01 * (known["delta1"] - known["delta2"])) / 0.056
        force = silicone.base_stress(strain) * tube.area
        assert np.sum(force) == pytest.approx(known["force_N"], abs=2e-7)
        assert np.sum(force * tube.height) == pytest.approx(known["moment_Nm"], abs=2e-9)


def _sequence(design, rows):
    """A bench that goes through prescribed pressures and fractions."""
    drive = {
        "pressure_kPa": np.array([r["pressure_Pa"] / 1e3 for r in rows]),
        "xi0_1": np.ones(len(rows)),
        "xi0_2": np.array([r["xi0_2"] for r in rows]),
    }
    take = Take("x", "fit", np.arange(len(rows), dtype=float), drive, len(rows))
    return Bench("actuator", [take], {}, {}, {}, "white", geometry={"design": design, "prestrain": 0.1924},
                 drives=tuple(drive), inputs=("pressure_kPa", "resistance_2_ohm"))  # fmt: skip


@pytest.mark.parametrize("number", range(4))
def test_path_dependent_sequences_agree_with_independent_values(shared, number):
    case = json.loads((shared / "oracle" / "history.json").read_text())["cases"][number]
    rows, bench = case["rows"], _sequence(case["design"], case["rows"])
    q = numbers.KRL35 | numbers.SPRING | numbers.TUBE
    out = actuator.actuator_truth(bench, q, around=500)
    np.testing.assert_allclose(out["curvature_1pm"][0, 0], [r["curvature_1pm"] for r in rows], atol=2e-5)
    np.testing.assert_allclose(out["resistance_2_ohm"][0, 0], [r["resistance_2_ohm"] for r in rows], rtol=1e-6)
    campaign = actuator.actuator_truth(bench, q)["curvature_1pm"]
    assert np.max(np.abs(campaign - out["curvature_1pm"])) < 0.03, "the campaigns' section is coarse against 0.2 1/m of noise"


@pytest.mark.parametrize("kind", list(PLANS))
def test_a_null_is_what_the_base_predicts(kind):
    rng = np.random.default_rng(3)
    bench = plan(kind, rng)
    q = true_numbers(bench, rng)
    truth = stand.truth(bench, q)
    predicted = stand.base(bench, q, truth)
    for column in bench.scored:
        assert np.max(np.abs(predicted[column] - truth[column])) < 1e-3 * bench.noise[column]


FEW_OF_SPRINGS = ("series_resistance", "coil_contact", "channel_lag")
QUICK = [key for key in registry.NAMED if key[0] in ("elastomer", "tube") or key[0] == "spring" and key[1] in FEW_OF_SPRINGS]


def base_at_the_true_fraction(bench, both, columns):
    """Of a heated spring by its true course, as in the refit that decides strength: several fractions may have the
    resistance that was recorded."""
    if not bench.hidden:
        return stand.base(bench, both, columns)
    return stand.forward(bench, both, columns, np.repeat(bench.stack(bench.hidden[1])[None], 2, axis=0))[0]


@pytest.mark.parametrize(("kind", "slug"), QUICK)
def test_an_effect_is_absent_at_zero_and_shows_otherwise(kind, slug):
    specimen = Specimen(kind, (slug,), 4)
    columns = specimen.columns([[0.0], [0.2]])
    both = {name: np.full(2, value) for name, value in specimen.numbers.items()}
    predicted = base_at_the_true_fraction(specimen.bench, both, columns)
    away = {c: np.abs(columns[c] - predicted[c]) / specimen.bench.noise[c] for c in specimen.bench.scored}
    floor = 0.2 if (kind, slug) == ("wire", "transformation_hysteresis") else 0.01  # a finite number of relays
    assert all(np.max(value[0]) < floor for value in away.values())
    assert max(np.max(value[1]) for value in away.values()) > 0.5


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "slug"), sorted(set(registry.NAMED) - set(QUICK)) + sorted(registry.OUTSIDE))
def test_a_costly_effect_is_absent_at_zero_and_shows_otherwise(kind, slug):
    test_an_effect_is_absent_at_zero_and_shows_otherwise(kind, slug)


def test_strength_is_what_was_asked_for():
    _, _, truth = build("elastomer", "single", ("viscoelastic_relaxation",), 100.0, 12)
    assert 60.0 < truth["log_bayes_post_refit"] < 160.0
    _, _, stronger = build("elastomer", "single", ("viscoelastic_relaxation",), 1000.0, 12)
    assert stronger["log_bayes_post_refit"] > 3 * truth["log_bayes_post_refit"]


def test_what_open_constants_absorb_is_not_called_strong():
    specimen = Specimen("spring", ("series_resistance",), 801)
    assert {"rho_mean", "alpha_1"} <= set(specimen.bench.tolerance)
    found = specimen.judge([0.02])
    assert found["fit_chi2"] < 1.1 and found["log_bayes"] < 3.0
    columns = {c: v[:1] for c, v in specimen.columns([[0.02]]).items()}
    data = (specimen.bench, specimen.whiten[0], columns, specimen.noise, specimen.true_z, specimen.felt, specimen.rest)
    judge, rng = HiddenJudge(*data), np.random.default_rng(5)
    costs = [judge.refit(rng.standard_normal(len(specimen.true_z)))[1] for _ in range(3)]
    best = judge.refit(found["end"])[1]
    assert np.max(np.abs(np.array(costs) - best)) < 8.0, "a refit that starts elsewhere ends elsewhere"


@pytest.mark.parametrize("attempt", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_what_a_refit_leaves_at_a_kink_is_not_called_strong(attempt):
    """A tenth of a percent of lead resistance that open resistivities take up: refits alone said 49 and 120."""
    specimen = Specimen("spring", ("series_resistance",), 2643462540, attempt=attempt)
    assert {"rho_mean", "alpha_1"} <= set(specimen.bench.tolerance)
    assert specimen.judge([0.0005 / specimen.effects[0].ceiling], [specimen.start])["log_bayes"] < 6.0


def test_a_masked_case_looks_acceptable_in_what_is_fitted():
    _, _, truth = build("tube", "masked", ("strain_stiffening",), None, 5)
    assert truth["refitted_base"]["fit_chi2"] < 1.3
    assert truth["refitted_base"]["validation_chi2"] > 2.0


def _hashes(folder):
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.iterdir())}


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    case = Case("c0000", "elastomer", "single", ("permanent_set",), 60.0, 31)
    truths = [write_case(case, tmp_path / name) for name in ("a", "b")]
    assert truths[0] == truths[1]
    assert _hashes(tmp_path / "a") == _hashes(tmp_path / "b")
    other = write_case(Case("c0000", "elastomer", "single", ("permanent_set",), 60.0, 32), tmp_path / "c")
    assert other != truths[0]


@pytest.mark.parametrize("kind", list(PLANS))
def test_files_hold_what_a_laboratory_has(tmp_path, kind):
    write_case(Case("c0001", kind, "null", (), None, 8), tmp_path / "x")
    sidecars = [tomllib.loads(p.read_text()) for p in sorted((tmp_path / "x").glob("*.toml"))]
    assert {s["role"] for s in sidecars} == {"fit", "validation"}
    assert all(s["kind"] == kind and s["tolerance"] for s in sidecars)
    for path in (tmp_path / "x").glob("*.csv"):
        header = path.read_text().splitlines()[0].split(",")
        assert ROWS[kind] in header and not any(name.startswith(("xi0", "hot")) for name in header)
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        assert 100 <= len(table) <= 200 and np.all(np.isfinite(table)) and np.all(np.diff(table[:, 0]) > 0)


def test_lists_are_repeatable_and_every_group_is_in_a_prefix():
    full = case_list("full", 5)
    assert full == case_list("full", 5) and full != case_list("full", 6)
    groups = [c.group for c in full]
    assert groups.count("null") >= 300 and groups.count("pair") >= 40 and groups.count("outside") >= 40
    assert sum(c.group == "single" and c.strength not in blind_cases.WEAKER for c in full) >= 100
    assert set(groups[:150]) == {"null", "single", "pair", "masked", "outside"}
    assert len({c.seed for c in full}) == len(full) and len({c.name for c in full}) == len(full)
    with pytest.raises(ValueError, match="plan must be one of"):
        case_list("all", 5)


def test_the_plan_of_digitised_nulls_has_every_way_of_every_kind():
    cases = case_list("readout", 5)
    assert len(cases) == 100 and cases == case_list("readout", 5) and cases != case_list("readout", 6)
    assert {(c.kind, c.slugs) for c in cases} == {(kind, (way,)) for kind in blind_cases.KINDS for way in READOUTS}
    assert {c.group for c in cases} == {"readout"} and len({c.seed for c in cases}) == 100


def _simple(rows=150):
    """A bench of one coupon, and its columns: a ramp and back with noise of 0.3."""
    strain = np.concatenate([np.linspace(0.0, 0.9, rows // 2), np.linspace(0.9, 0.0, rows - rows // 2)])
    stress = 100.0 * strain + 0.3 * np.random.default_rng(2).standard_normal(rows)
    take = Take("pull_1", "fit", np.arange(float(rows)), {"strain": strain}, rows)
    bench = Bench("elastomer", [take], {}, {}, {"stress_kPa": 0.3}, "white", inputs=("strain",), outputs=("stress_kPa",))
    return bench, {"strain": strain[None], "stress_kPa": stress[None]}


@pytest.mark.parametrize("way", READOUTS)
def test_digitised_columns_stay_on_the_curve_that_was_measured(way):
    bench, columns = _simple()
    read, found = read_out(bench, columns, way, np.random.default_rng(3))
    (take,), strain, stress = read.recordings, found["strain"][0], found["stress_kPa"][0]
    assert len(strain) == len(stress) == len(take.time) == take.rows and np.all(np.diff(take.time) > 0.0)
    off = np.abs(stress - 100.0 * strain)
    allowed = {"rounded": 3.0, "clipped": 90.0, "slow_output": 6.0}
    assert np.max(off) < allowed.get(way, 1.2)
    moves = np.diff(np.unique(stress))
    if way == "rounded":
        step = np.min(moves[moves > 1e-9])
        assert np.allclose(stress / step, np.round(stress / step), atol=1e-6)
        assert read.noise["stress_kPa"] == pytest.approx(np.hypot(0.3, step / np.sqrt(12.0)))
    if way == "clipped":
        assert 0.02 < np.mean(stress == stress.max()) < 0.16
    if way in ("held", "slow_output"):
        assert np.mean(np.diff(stress) == 0.0) > 0.4
    assert (len(stress) > 220) == (way in ("held", "interpolated")) and (len(stress) < 60) == (way == "sparse")


@pytest.mark.parametrize("way", ["rounded", "interpolated"])
def test_a_digitised_null_conceals_nothing(tmp_path, way):
    truth = write_case(Case("c0001", "elastomer", "readout", (way,), None, 8), tmp_path / "x")
    assert truth["slugs"] == [] and truth["readout"] == way and truth["log_bayes_post_refit"] is None
    assert sorted(p.suffix for p in (tmp_path / "x").iterdir())[0] == ".csv"


def test_seals_open_only_once_every_report_exists(tmp_path):
    chosen = [Case("c0000", "elastomer", "null", (), None, 1), Case("c0001", "elastomer", "single", ("mullins_softening",), 50.0, 2)]
    seal(chosen[:1], tmp_path / "data")
    before = _hashes(tmp_path / "data" / "c0000")
    seal(chosen, tmp_path / "data")
    assert _hashes(tmp_path / "data" / "c0000") == before
    everything = "".join(p.read_text() for p in (tmp_path / "data").rglob("*") if p.is_file())
    assert "mullins" not in everything
    with pytest.raises(ValueError, match="stays sealed"):
        open_seals(chosen, tmp_path / "data", tmp_path / "reports")
    for case in chosen:
        (tmp_path / "reports" / case.name).mkdir(parents=True)
        (tmp_path / "reports" / case.name / "report.json").write_text("{}")
    truths = open_seals(chosen, tmp_path / "data", tmp_path / "reports")
    assert truths["c0001"]["slugs"] == ["mullins_softening"] and truths["c0000"]["group"] == "null"
    book = json.loads((tmp_path / "data" / "seals.json").read_text())
    (tmp_path / "data" / "seals.json").write_text(json.dumps(book | {"c0001": "0" * 64}))
    with pytest.raises(ValueError, match="does not match its seal"):
        open_seals(chosen, tmp_path / "data", tmp_path / "reports")
