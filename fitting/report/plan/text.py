"""Sentences of a plan: tests, order and expected result."""

import numpy as np

from fitting.calibrate.spring.reach import HOT_STEPS
from fitting.inference.notes import joined
from fitting.plan.candidates import LEG_ROWS
from fitting.plan.plan import KNOWN, Plan
from fitting.plan.rates import MOST_LOST
from fitting.synthesise.controller import rest_resistances
from fitting.synthesise.spring import COLD_WIDTHS
from pneusma_jax.errors import counted

from ..cells import percent

UNTOLD = 0.7
"""1-sigma after a test over that before, from which prior and test weigh alike: it says next to nothing."""
LEFT = "In brackets: the expected 1-sigma after that test alone, in units of what is known before it."


def verdict(plan: Plan) -> list[str]:
    """The few most important sentences."""
    relative = plan.relative_sd()
    good = [name for name in plan.wanted if relative[name] <= KNOWN]
    poor = [name for name in plan.wanted if relative[name] > KNOWN]
    count = sum(test.repeats for test in plan.tests)
    pieces = [
        f"{counted(count, 'test')}, {plan.minutes / 60.0:.1f} hours with set-up, one of them for validation "
        "only.",
        f"Expected to {percent(KNOWN)} or better: {', '.join(good) or 'none'}.",
    ]
    if poor:
        stated = ", ".join(f"{name} ({percent(relative[name])})" for name in poor)
        why = next((text for text in plan.loose if any(name in text for name in poor)), "")
        pieces.append(f"Less well known after these tests: {stated}. {why}".rstrip())
    return pieces


def tellers(plan: Plan) -> list[str]:
    """Sentences about the test that determines each constant best, one for all constants of a test."""
    said: dict[str, list[str]] = {}
    for name, found in plan.tellers.items():
        told = found[0].left < UNTOLD
        said.setdefault(found[0].candidate.words if told else "", []).append(
            f"{name} ({percent(found[0].left)})"
        )
    silent = said.pop("", [])
    sentences = [f"{words[0].upper()}{words[1:]}: tells {joined(names)}." for words, names in said.items()]
    if silent:
        sentences.append(
            f"No single test tells {joined(silent)} to less than {percent(UNTOLD)} of what is known before."
            " Only several together do."
        )
    return [*sentences, LEFT]


def preparation(plan: Plan) -> list[str]:
    """Preparations for the first test."""
    alloy = plan.spring.alloy
    cold, hot = rest_resistances(plan.spring)
    temperature = float(alloy.T_mid) - COLD_WIDTHS * float(alloy.T_width)
    interval = min(test.sampling_s for test in plan.tests)
    return [
        f"In still air this wire cools from full heat in about {plan.cooling_s:.0f} s, by assumed constants."
        " Nothing but moving air makes that faster, so wait as long before each test.",
        *_lost(plan),
        "Before every test heat the spring fully without load and let it cool: each recording starts fresh.",
        "Cold means wholly martensitic: well below the transformation,"
        f" {temperature:.0f} degC if it is centred at {float(alloy.T_mid):.0f} degC. In a warm room a share"
        " of austenite stays and spoils the cold test.",
        "First measure the resistance at rest, cold (R_cold) and at full current (R_hot). Set-points are"
        " stated as the share s: hold R_hot + s (R_cold - R_hot). In ohms they are given for the first guess"
        f" ({cold:.3f} and {hot:.3f} ohm).",
        f"Do not stretch a hot spring beyond {100.0 * plan.steps[HOT_STEPS - 1]:.0f} %. At high strain a"
        " set-point cannot be held: go on, the recording is still good.",
        f"Record time, elongation, force and resistance at least every {interval:g} s; name the files as the"
        " tests, and see `pneusma import` for other column names.",
    ]


def _lost(plan: Plan) -> list[str]:
    """Sentences on set-points that no speed of the plan holds; none where all are held."""
    why = {
        True: "still air cools this wire too slowly. Blow air over the spring, or pull slower.",
        False: "the supply heats this wire too slowly. Pull slower.",
    }
    found = {hot: [f"{s:g}" for s in sorted(plan.lost) if plan.lost[s] == hot] for hot in why}
    return [
        f"At the share {joined(shares)} the set-point is lost for more than {percent(MOST_LOST)} of the time,"
        f" even at the stated speed: {why[hot]}"
        for hot, shares in found.items()
        if shares
    ]


def reasons(plan: Plan) -> list[str]:
    """Reasons for the choice of tests, and assumptions."""
    return [
        f"Each test is valued by the expected fall in the uncertainty of {', '.join(plan.wanted)} per minute."
        " The fall follows from the sensitivities of the spring's law. Tests were exchanged until no exchange"
        " helped.",
        f"The expectation is over alloys that the priors of {plan.knowledge.table.name} allow. Noise: force"
        f" {plan.noise[0]:g} N, resistance {plan.noise[1]:g} ohm, independent at {LEG_ROWS} readings on every"
        f" pull and return. The law itself errs by {percent(plan.misfit)} of the force and of the contrast in"
        " resistance, in every repeat alike.",
        "The phase is not taken as known: it deviates, and resistance and force must settle it together with"
        " the constants.",
        "Speeds: the fastest at which a controller holds the resistance of such a spring, by simulation of"
        " its heat balance. The thermal constants are assumptions; slow down if the set-point is lost at low"
        " strain.",
        "After the campaign, `pneusma characterise` says which test is worth most next, from the data.",
    ]


def comparison(plan: Plan) -> str:
    """Comparison with the published campaign."""
    rows = [plan.knowledge.names.index(name) for name in plan.wanted]
    ratio = np.exp(np.mean(np.log(plan.sd[-1, rows] / plan.published_sd[rows])))
    fitted = sum(test.minutes * test.repeats for test in plan.tests if test.role == "fit")
    return (
        f"The published campaign's seven tests take {plan.published_minutes:.0f} minutes at speeds that hold"
        f" their resistances; these tests take {fitted:.0f} minutes. The published ones would leave the"
        f" wanted constants with 1-sigmas of {percent(1.0 / ratio)} of these, on average."
    )
