"""Free, fixed, tied and bounded parameters in the manner of lmfit, and their vector for a fit.

There are deliberate differences from lmfit. A value outside its bounds is refused, not clipped. Bounds are a
box around the fit instead of a folded sine. A parameter may be fitted by its logarithm. A tie is plain
arithmetic.
"""

from pneusma_jax.calibration.records import Prior

from .collection import Layout, Parameters
from .parameter import Parameter
from .table import format_estimate

__all__ = ["Layout", "Parameter", "Parameters", "Prior", "format_estimate"]
