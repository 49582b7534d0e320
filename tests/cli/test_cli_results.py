"""Every type of result has a report, and a command imports no report but its own."""

import importlib
import subprocess
import sys

import pytest

from fitting.inference.results import Result
from fitting.report.results import REPORTS


def test_every_named_type_and_its_report_exist():
    for kind, function in REPORTS.items():
        found = [
            getattr(importlib.import_module(f"{package}{module}"), name)
            for package, (module, name) in (("", kind.split(":")), ("fitting.report.", function.split(":")))
        ]
        assert issubclass(found[0], Result) and callable(found[1])
        assert f"{found[0].__module__}:{found[0].__qualname__}" == kind  # where it is defined, by which it is found


def test_every_type_of_result_has_a_report():
    for kind in REPORTS:
        importlib.import_module(kind.split(":")[0])
    kinds = [kind for kind in Result.__subclasses__() if kind.__module__.startswith("fitting.")]
    kinds += [inner for kind in kinds for inner in kind.__subclasses__()]
    known = [f"{kind.__module__}:{kind.__qualname__}" for kind in kinds if not kind.__qualname__.startswith("_")]
    assert set(REPORTS) <= set(known), "a type that is no result"
    lost = [k for k in kinds if not any(f"{m.__module__}:{m.__qualname__}" in REPORTS for m in k.__mro__)]
    assert not [k for k in lost if not k.__subclasses__()], "a result without report"


@pytest.mark.slow
def test_a_command_imports_nothing_of_other_commands(tmp_path):
    words, others = ["wiring", "--springs", "2"], {"fitting.diagnose", "fitting.calibrate", "fitting.sample", "blackjax"}
    code = f"from fitting.cli import main; main({[*words, '--out', str(tmp_path / 'out')]!r}, standalone_mode=False)"
    code += f"; import sys; print(*({{*sys.modules}} & {others!r}), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr.strip() == "", done.stderr
