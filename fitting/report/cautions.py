"""Sentences with which reports of characterisations begin where constants are not to be trusted.

Files of such a result hold them, too. So every command that takes the numbers from there repeats them.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import singledispatch

from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.result import Characterisation
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.files import render_model
from pneusma_jax.calibration import Calibration

from .characterisation import with_caution
from .elastomer import text as elastomer
from .general import text as general
from .spring import text as spring


@singledispatch
def cautions(result: Characterisation | None) -> Sequence[str]:
    """Sentences with which a result's own report begins because its constants are not to be trusted."""
    return ()


@singledispatch
def distrust(result: Characterisation | None) -> Sequence[str]:
    """The same of every kind of result, whose own report may say them later; empty where all is well."""
    return cautions(result)


@distrust.register
def _(result: ElastomerCharacterisation) -> Sequence[str]:
    """What the selected law leaves beyond noise; the report says it after the law."""
    return elastomer.left_by(result)


def table_of(table: Calibration, result: Characterisation) -> str:
    """TOML text of a result's table, with a `caution` where its constants are not to be trusted."""
    return with_caution(table, " ".join(distrust(result)))


def model_of(model: AugmentedModel, result: Characterisation) -> str:
    """TOML text of a result's model, with a `caution` where its constants are not to be trusted."""
    return render_model(replace(model, caution=" ".join(distrust(result))))


cautions.register(GeneralCharacterisation, general.cautions)
cautions.register(SpringCharacterisation, spring.cautions)
