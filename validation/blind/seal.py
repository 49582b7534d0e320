"""Sealing: data and a hash of the truth are written first. The truth is opened only once every report exists.

The hash is of the canonical JSON of the truth together with a salt from the case's seed. So it can neither be
guessed by trying the catalogue nor be changed afterwards.
"""

import hashlib
import json
import shutil
from pathlib import Path

import numpy as np

from .cases import truth_of, write_case


def _hash(case, truth):
    salt = np.random.default_rng([case.seed, 99]).bytes(16).hex()
    text = salt + json.dumps(truth, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _read(path):
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def _write(path, content):
    """Write a file whole or not at all, without the tool's own writer, since the trial shares no code with
    it."""
    draft = path.with_name(f".{path.name}.part")
    draft.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    draft.replace(path)


def seal(cases, directory):
    """Write each case's campaign to directory/<name>/ and the hash of its truth to directory/seals.json.

    Cases already sealed are skipped, so that a long list can be sealed in pieces. Raises ValueError where a
    sealed case of that name has another seed.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    book = directory / "seals.json"
    seals = _read(book)
    for case in cases:
        if case.name in seals and (directory / case.name).is_dir():
            continue
        shutil.rmtree(directory / case.name, ignore_errors=True)
        truth = write_case(case, directory / case.name)
        seals[case.name] = _hash(case, truth)
        _write(book, seals)


def open_seals(cases, directory, reports):
    """Truths by name, recomputed from the seeds and checked against their seals.

    Raises ValueError while any case has no reports/<name>/report.json or no seal, and where a truth does not
    match its seal.
    """
    directory, reports = Path(directory), Path(reports)
    seals = _read(directory / "seals.json")
    missing = [case.name for case in cases if not (reports / case.name / "report.json").exists()]
    if missing:
        raise ValueError(f"the truth stays sealed: {len(missing)} of {len(cases)} reports are missing, first {missing[0]}")
    unsealed = [case.name for case in cases if case.name not in seals]
    if unsealed:
        raise ValueError(f"no seal for {len(unsealed)} cases, first {unsealed[0]}")
    opened = directory / "opened.json"
    truths = _read(opened)
    for case in cases:
        if case.name not in truths:
            truths[case.name] = truth_of(case)
            _write(opened, truths)
        if _hash(case, truths[case.name]) != seals[case.name]:
            raise ValueError(f"the truth of {case.name} does not match its seal")
    return {case.name: truths[case.name] for case in cases}
