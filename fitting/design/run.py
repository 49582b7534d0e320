"""A study from its start to its result."""

import hashlib
import inspect
import itertools
import json
import secrets
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import pneusma_jax as pj
from pneusma_jax.calibration import named_table
from pneusma_jax.errors import InputError
from pneusma_jax.pipeline import Effect
from pneusma_jax.program_cache import of_package

from .bodies import alloy_of, material_of, plan_of
from .conclude import result_of
from .log import Log
from .program import Model
from .result import Choice, DesignResult
from .search import search_design
from .study import Study
from .uncertain import sampler_of


def run_study(
    study: Study, log: Path | None = None, progress: Callable[[str], object] = lambda text: None
) -> DesignResult:
    """Solve a study.

    Args:
        study: study from `reading.read_study`.
        log: file of the evaluations, from which a killed study goes on; None keeps them in memory.
        progress: called with a few words after every lot of evaluations.

    Raises:
        InputError: one line, if nothing can be evaluated, or constraints contradict each other. The file of
            the evaluations is removed then, unless an earlier run made some of them.
    """
    kept = Log(log, fingerprint(study))
    try:
        return _solved_study(study, kept, progress)
    except InputError:
        kept.discard()
        raise


def _solved_study(study: Study, kept: Log, progress: Callable[[str], object]) -> DesignResult:
    """Solve every combination of choices, and take the best."""
    choices = [Choice(*one) for one in itertools.product(study.designs, study.alloys, study.materials)]
    solved = []
    for number, choice in enumerate(choices):
        words = f"choice {number + 1} of {len(choices)}: " if len(choices) > 1 else ""
        said = lambda text, words=words: progress(words + text)  # noqa: E731
        solved.append(_solve_choice(study, choice, number, kept, said))
    return result_of(study, solved, kept, progress)


def fingerprint(study: Study) -> str:
    """Fingerprint of everything that the evaluations of a study depend on."""
    seen = [study.path.read_bytes(), version("pneusma-jax").encode()]
    files = {f.file for f in (*study.objectives, *study.constraints) if f.file is not None}
    seen += [path.read_bytes() for path in sorted(files)]
    if study.uncertainty is not None and study.uncertainty.posterior is not None:
        seen.append(study.uncertainty.posterior.read_bytes())
    if study.model.path is not None:
        seen.append(study.model.path.read_bytes())
    seen += [_source(type(effect)) for effect in study.model.effects]
    for one in itertools.product(study.designs, study.alloys, study.materials):
        plan = plan_of(*one, study.model)
        with_springs = [t for t in plan.tables if pj.layout(t).spring_numbers]
        alloys = {plan.alloy or named_table(t, "alloy"): alloy_of(plan, t) for t in with_springs}
        tables = [*plan.tables, *(alloys[name] for name in sorted(alloys))]
        tables += [material_of(plan, k) for k in range(len(plan.tables))]
        seen += [
            json.dumps([t.name, sorted(t.values().items()), sorted(t.text.items())]).encode() for t in tables
        ]
        seen.append(repr(plan.chain).encode())
    return hashlib.sha256(b"\0".join(seen)).hexdigest()


def _source(effect: type) -> bytes:
    """Text of an effect that is not of the package, with what it inherits; empty for one of the package."""
    own = [law for law in effect.__mro__ if not of_package(law) and issubclass(law, Effect)]
    try:
        return "".join(map(inspect.getsource, own)).encode()
    except (OSError, TypeError):  # typed in at a prompt: it cannot be told from another one
        return secrets.token_bytes()


def _solve_choice(study: Study, choice: Choice, number: int, log: Log, said: Callable[[str], object]) -> dict:
    """The nominal solution of a combination of choices, and the one under uncertainty."""
    plan = plan_of(choice.design, choice.alloy, choice.material, study.model)
    if study.uncertainty is None:
        return {"nominal": search_design(study, choice, Model(study, plan), number, log, said, [])}
    calm = _without_uncertainty(study)
    nominal = search_design(
        calm, choice, Model(calm, plan), -1 - number, log, lambda text: said("nominal, " + text), []
    )
    begin = [o.evaluation.place for o in (nominal.ideal,) if o.evaluation is not None]
    draws = sampler_of(study, plan).draw(study.uncertainty.draws, study.seed, spread_out=True)
    robust = search_design(study, choice, Model(study, plan, draws), number, log, said, begin)
    return {"nominal": nominal, "robust": robust}


def _without_uncertainty(study: Study) -> Study:
    """The same study with everything nominal; objectives that only uncertainty has are left out."""
    import_free = [o for o in study.objectives if o.quantity != "failure_probability"]
    return Study(**{**study.__dict__, "uncertainty": None, "objectives": tuple(import_free)})
