"""Studies to test with: expressions, whose answers are exact and whose programs compile at once."""

from pathlib import Path

ISHIGAMI = """
schema = "pneusma-study/1"
name = "ishigami"
[model]
through = "expression"
outputs = {y = "sin(x1) + 7*sin(x2)**2 + 0.1*x3**4*sin(x1)"}
[input]
x1 = {low = -3.141592653589793, high = 3.141592653589793}
x2 = {low = -3.141592653589793, high = 3.141592653589793}
x3 = {low = -3.141592653589793, high = 3.141592653589793}
"""
PLAIN = """
schema = "pneusma-study/1"
name = "plain"
[model]
through = "expression"
outputs = {y = "a + 2*b"}
[input]
a = {mean = 1.0, sd = 0.5}
b = {mean = 0.0, sd = 1.0}
"""
ONE_STATE = """
schema = "pneusma-study/1"
name = "state"
[model]
through = "state"
design = "pneusma2"
pressure_kPa = 30.0
"""
EXAMPLES = Path(__file__).resolve().parents[2] / "calibration_data" / "examples"


def tube_study(points: int, more: str) -> str:
    """A study through the recording of a shipped tube at so many points, and further tables."""
    return f"""
schema = "pneusma-study/1"
[model]
through = "recording"
recording = "{EXAMPLES / "tube" / "inflation_1.csv"}"
points = {points}
{more}
"""
