"""Commands and programs show a result by the same function, and a command imports no report but its own."""

import importlib
import subprocess
import sys

from fitting.cli._results import REPORTS
from fitting.report.results import REPORTS as REGISTERED


def test_commands_and_programs_show_each_result_by_the_same_function():
    assert set(REPORTS) == {kind.__name__ for kind in REGISTERED}
    for kind, function in REGISTERED.items():
        module, name = REPORTS[kind.__name__].split(":")
        assert getattr(importlib.import_module(f"fitting.report.{module}"), name) is function


def test_a_command_imports_nothing_of_other_commands(tmp_path):
    words, others = ["wiring", "--springs", "2"], {"fitting.diagnose", "fitting.calibrate", "fitting.sample", "blackjax"}
    code = f"from fitting.cli import main; main({[*words, '--out', str(tmp_path / 'out')]!r}, standalone_mode=False)"
    code += f"; import sys; print(*({{*sys.modules}} & {others!r}), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr.strip() == "", done.stderr
