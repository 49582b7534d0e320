"""The report of a characterised alloy."""

from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.calibrate.spring.scores import overall
from pneusma_jax.units import from_si

from .. import characterisation
from ..cautions import table_of
from ..cells import number
from ..open_constants import open_sentences
from ..report import Points, Report, Section
from ..table import Table
from . import text
from .figures import pictures
from .payload import content

SCORES = (
    "Shear stress predicted from elongation and resistance alone. MAE and RMSE in MPa. RPD is the mean "
    f"relative difference (Eq. 2.52) of absolute values. {characterisation.SIGNED} Blind: rows whose "
    "resistance hardly tells the martensite fraction."
)
NOTHING = "Nothing: every free constant is known better than before."


def report_of(result: SpringCharacterisation) -> Report:
    """The report of the result."""
    drawn = pictures(result)
    loose = open_sentences(result.identifiability) or [NOTHING]
    verdict = text.verdict(result)
    return Report(
        title=result.title,
        subtitle=_subtitle(result),
        verdict=verdict,
        warnings=[said for said in text.warnings(result) if said not in verdict],
        real=result.real,
        sections=[
            Section("Fit", [drawn["fit"]]),
            Section("What was measured", [_combinations(result)]),
            Section("Parameters", [_parameters(result)]),
            Section("Errors, test by test", [_scores(result)]),
            Section("What these tests cannot tell",
                    [Points(loose), *(drawn[name] for name in ("profiles",) if name in drawn)]),
            Section("Other fits as good", [Points([text.mode_sentence(mode) for mode in result.modes])]),
            Section("Next test", [result.next_test.text]),
            Section("Laws and phases", [drawn["laws"], drawn["phase"]]),
            Section("What each test was taken to be", [Points(text.phases(result))]),
            Section("How it was fitted", [Points(text.how_it_was_fitted(result))]),
            Section("Notices", [Points(result.notices)]),
        ],
        window=f"{result.title}: characterisation",
        footer=characterisation.footer(result.seed),
        content=lambda: content(result),
        files=lambda: {
            "alloy.toml": table_of(result.table(), result),
            "parameters.csv": characterisation.parameters_csv(result.parameters),
        },
    )  # fmt: skip


def _subtitle(result: SpringCharacterisation) -> str:
    fitted = [test.name for test in result.tests if test.fitted]
    held_out = [test.name for test in result.tests if not test.fitted]
    return characterisation.subtitle("Spring on a stand", "test", fitted, held_out)


def _parameters(result: SpringCharacterisation) -> Table:
    start = {n: float(from_si(result.start[n], e.unit)) for n, e in result.fitted.items()}
    share = {name: estimate.of_prior for name, estimate in result.parameters.items()}
    return characterisation.parameter_table(result.parameters, start, share)


def _combinations(result: SpringCharacterisation) -> Table:
    return characterisation.combination_table(result.combinations)


def _row(name: str, role: str, measures: dict[str, float], blind: float | None) -> list[str]:
    cells = [number(measures[key]) for key in ("mae_MPa", "rmse_MPa")]
    cells += [number(100.0 * measures[key]) for key in ("rpd", "rpd_signed")]
    return [name, role, *cells, number(None if blind is None else 100.0 * blind, ".0f")]


def _scores(result: SpringCharacterisation) -> Table:
    rows = [_row(s.name, s.role, s.metrics, s.uninformed) for s in result.scores if s.stress.size]
    for role, name in (("fit", "all fitted"), ("validation", "all held out")):
        together = overall(result.scores, role)
        if together is not None:
            rows.append(_row(name, role, together, None))
    header = ["test", "role", "MAE MPa", "RMSE MPa", "RPD %", "signed %", "blind %"]
    return Table(header, rows, SCORES)
