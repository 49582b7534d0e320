"""Files of one run of the trial, and JSON files that are written whole or not at all."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

from pneusma_jax.files import write_whole

ROOT = Path(__file__).resolve().parents[3]
CODE = ("fitting", "pneusma_jax", "calibration_data", "validation/blind")
"""Paths of the code that a result depends on."""


@dataclass(frozen=True)
class Places:
    """Folders of a run: sealed campaigns, and reports under a label, so that a later tool can be tried on the
    same cases."""

    folder: Path
    label: str = ""

    @property
    def campaigns(self):
        return self.folder / "campaigns"

    @property
    def reports(self):
        return self.folder / ("reports" + self._suffix)

    @property
    def score(self):
        return self.folder / f"score{self._suffix}.json"

    @property
    def figures(self):
        return self.folder / ("figures" + self._suffix)

    @property
    def _suffix(self):
        return f"-{self.label}" if self.label else ""

    def report(self, name):
        return self.reports / name / "report.json"

    def timing(self, name):
        return self.reports / name / "timing.json"

    def baselines(self, name):
        return self.reports / name / "baselines.json"


def read(path, missing=None):
    """Content of a JSON file; `missing` if there is none."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else missing


def write(path, content):
    """Write JSON whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, as_bytes(content))


def as_bytes(content):
    """JSON as it stands in a file."""
    return (json.dumps(content, indent=1) + "\n").encode()


def commit():
    """Commit of the code under trial, with a plus where files of it differ; "unknown" outside a
    repository."""
    try:
        head = _git("rev-parse", "--short=12", "HEAD")
        return head + ("+" if _git("status", "--porcelain", "--untracked-files=no", "--", *CODE) else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*words):
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
