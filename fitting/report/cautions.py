"""Sentences with which reports of characterisations begin where constants are not to be trusted."""

from collections.abc import Sequence
from functools import singledispatch

from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.result import Characterisation
from fitting.calibrate.spring.pipeline import SpringCharacterisation

from .general import text as general
from .spring import text as spring


@singledispatch
def cautions(result: Characterisation | None) -> Sequence[str]:
    """Sentences with which a result's own report begins because its constants are not to be trusted."""
    return ()


cautions.register(GeneralCharacterisation, general.cautions)
cautions.register(SpringCharacterisation, spring.cautions)
