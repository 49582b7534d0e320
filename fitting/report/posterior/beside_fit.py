"""What a posterior does not count beside its fit: physics that the law leaves out, zeros of instruments.

Draws take the noise of the fit. If the law misses its recordings, they gather about a wrong place all the
same, and agree with the fit's Gaussian there.
"""

from functools import singledispatch

from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.result import Characterisation
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.inference.lasting_noise import Lasting
from fitting.inference.numbers import number

from ..cautions import distrust
from ..instrument_zeros import error_factors


def opening(fit: Characterisation | None) -> list[str]:
    """Sentences with which the report of a posterior begins; empty where its intervals count everything.

    Args:
        fit: characterisation that the density comes from; None without one, about which nothing is known.
    """
    lasting, inflation = _lasting(fit), _inflation(fit)
    doubts, zeros = list(distrust(fit)), error_factors(1.0, lasting)
    if not doubts and not zeros:
        return []
    noise = "the noise as stated or estimated"
    if inflation > 1.0:
        noise = f"noise that is {number(inflation, '.2g')} times the one stated or estimated, as in the fit,"
    elif lasting is not None and lasting.fitted_beside_zeros:
        noise = "the noise as stated or estimated and zeros of instruments that drift, as in the fit,"
    said = [*doubts, f"The draws take {noise} as all there is."]
    if zeros:
        said.append(
            f"Errors of `pneusma characterise` are besides {zeros}. The draws do not count these: its "
            "intervals are wider by up to that factor."
        )
    if doubts:
        said.append("A wrong law makes draws that agree with each other and not with the specimen.")
    return said


@singledispatch
def _lasting(fit: Characterisation | None) -> Lasting | None:
    """Zeros of instruments that widen the errors of a fit."""
    return None


@singledispatch
def _inflation(fit: Characterisation | None) -> float:
    """Factor on the noise that fit and draws share."""
    return 1.0


_lasting.register(GeneralCharacterisation, lambda fit: fit.lasting)
_lasting.register(SpringCharacterisation, lambda fit: fit.lasting)
_inflation.register(GeneralCharacterisation, lambda fit: fit.fit.inflation)
_inflation.register(SpringCharacterisation, lambda fit: fit.joint.inflation)
_inflation.register(ElastomerCharacterisation, lambda fit: fit.best.inflation)
