"""Differentiable model of pneumatic soft actuators with resistance-sensed nitinol springs.

Call `enable_float64()` once, then:

    >>> import pneusma_jax as pj
    >>> pj.enable_float64()
    >>> body = pj.make_actuator("pneusma2")
    >>> cold, warm = pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.4)
    >>> float(pj.solve(body, 30e3, (cold, warm)).curvature)  # 1/m

A name is loaded when it is first used (PEP 562), and with it the libraries that it needs. So what reads units
or tables alone does not wait for JAX.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import actuator as actuator
    from . import calibration as calibration
    from . import effects as effects
    from . import errors as errors
    from . import nitinol as nitinol
    from . import pipeline as pipeline
    from . import precision as precision
    from . import section as section
    from . import serial_chain as serial_chain
    from . import silicone as silicone
    from . import simulate as simulate
    from . import units as units
    from .actuator import Actuator, Geometry, Layout, build_actuator, round_actuator
    from .actuator.designs import design_geometry, design_section, fresh_states, layout, make_actuator
    from .actuator.equilibrium import Equilibrium, Status, Validity, solve, solve_all, solve_batch
    from .actuator.loads import Gravity, Load, TipForce, gravity_vector
    from .actuator.weight import mass_of, weight
    from .calibration import available, load_calibration
    from .errors import InputError
    from .nitinol import (
        Alloy,
        MartensiteFraction,
        Resistance,
        Spring,
        SpringGeometry,
        SpringState,
        Temperature,
        WireResistance,
        load_alloy,
        load_wire,
        phase_fractions,
        simulate_wire,
        spring_strain,
    )
    from .nitinol.thermal import Heating
    from .precision import enable_float64
    from .section import Section, annulus
    from .section.kinds import polygon, rectangle, semicircle
    from .serial_chain.loads import ChainLoad, ChainWeight, LineLoad, PointLoad
    from .serial_chain.segments import ChainEquilibrium, ChainHistory, SegmentChain, chain_of
    from .serial_chain.solve import simulate_chain_history, solve_chain
    from .serial_chain.weight import chain_weight
    from .silicone import load_silicone, load_silicone_test, tube_length
    from .simulate.coupon import CouponHistory, simulate_coupon
    from .simulate.history import History, simulate_history
    from .simulate.spring import SpringHistory, simulate_spring
    from .simulate.tube import TubeHistory, make_tube, simulate_tube

__all__ = [
    "Actuator", "Alloy", "ChainEquilibrium", "ChainHistory", "ChainLoad", "ChainWeight", "CouponHistory",
    "Equilibrium", "Geometry", "Gravity", "Heating", "History", "InputError", "Layout", "LineLoad",
    "Load", "MartensiteFraction", "PointLoad", "Resistance", "Section", "SegmentChain", "Spring",
    "SpringGeometry", "SpringHistory", "SpringState", "Status", "Temperature", "TipForce", "TubeHistory",
    "Validity", "WireResistance", "annulus", "available", "build_actuator", "chain_of", "chain_weight",
    "design_geometry", "design_section", "enable_float64", "fresh_states", "gravity_vector", "layout",
    "load_alloy", "load_calibration", "load_silicone", "load_silicone_test", "load_wire", "make_actuator",
    "make_tube", "mass_of", "phase_fractions", "polygon", "rectangle", "round_actuator", "semicircle",
    "simulate_chain_history", "simulate_coupon", "simulate_history", "simulate_spring", "simulate_tube",
    "simulate_wire", "solve", "solve_all", "solve_batch", "solve_chain", "spring_strain", "tube_length",
    "weight",
]  # fmt: skip

_NAMES = {
    "actuator": "Actuator Geometry Layout build_actuator round_actuator",
    "actuator.designs": "design_geometry design_section fresh_states layout make_actuator",
    "actuator.equilibrium": "Equilibrium Status Validity solve solve_all solve_batch",
    "actuator.loads": "Gravity Load TipForce gravity_vector",
    "actuator.weight": "mass_of weight",
    "calibration": "available load_calibration",
    "errors": "InputError",
    "nitinol": (
        "Alloy MartensiteFraction Resistance Spring SpringGeometry SpringState "
        "Temperature WireResistance load_alloy load_wire phase_fractions simulate_wire "
        "spring_strain"
    ),
    "nitinol.thermal": "Heating",
    "precision": "enable_float64",
    "section": "Section annulus",
    "section.kinds": "polygon rectangle semicircle",
    "serial_chain.loads": "ChainLoad ChainWeight LineLoad PointLoad",
    "serial_chain.segments": "ChainEquilibrium ChainHistory SegmentChain chain_of",
    "serial_chain.solve": "simulate_chain_history solve_chain",
    "serial_chain.weight": "chain_weight",
    "silicone": "load_silicone load_silicone_test tube_length",
    "simulate.coupon": "CouponHistory simulate_coupon",
    "simulate.history": "History simulate_history",
    "simulate.spring": "SpringHistory simulate_spring",
    "simulate.tube": "TubeHistory make_tube simulate_tube",
}
_PACKAGES = (
    "actuator", "calibration", "effects", "errors", "nitinol", "pipeline", "precision", "section",
    "serial_chain", "silicone", "simulate", "units",
)  # fmt: skip
_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names.split()}


if not TYPE_CHECKING:  # else any misspelt name would have the type Any

    def __getattr__(name: str) -> Any:
        """A public name from the module that defines it, or a package; both stay once they are loaded."""
        if name in _PACKAGES:
            return importlib.import_module(f".{name}", __name__)
        if name not in _MODULE_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        found = getattr(importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    """Public names, packages, and what every module has; not the helpers of this one."""
    special = (name for name in globals() if name.startswith("__"))
    return sorted({*special, *__all__, *_PACKAGES})
