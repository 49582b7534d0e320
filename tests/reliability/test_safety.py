"""What files, disks and terminals may do to a run: one clear line, nothing half-written, no code from a file."""

import ast
import errno
import importlib
import os
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli import main
from fitting.data.publish import publish
from fitting.data.recordings import read_recording
from fitting.data.recordings.writing import recording_texts
from fitting.design import read_study
from fitting.engine import objects
from fitting.inference.parameters.ties import evaluate, names_in
from pneusma_jax import InputError, enable_float64, program_cache

ROOT = Path(__file__).resolve().parents[2]
AT_ROOT = {"PYTHONPATH": str(ROOT)}
"""Environment in which a process elsewhere finds this checkout."""
CODE_FROM_FILES = {
    "eval",
    "exec",
    "compile",
    "pickle",
    "cPickle",
    "marshal",
    "shelve",
    "dill",
    "joblib",
    "yaml",
    "runpy",
}
EXCEPTIONS = {"objects.py": "pickle", "functions.py": "runpy"}
"""Modules that may import such a library. Stored fits are read through a list of classes, and a function that a study
names is the user's own program; each has tests below."""


def sources() -> list[Path]:
    return [path for package in ("pneusma_jax", "fitting") for path in sorted((ROOT / package).rglob("*.py"))]


def test_nothing_that_runs_code_from_a_file_is_used():
    calls, imported, arguments = [], [], []
    for path in sources():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in CODE_FROM_FILES:
                calls.append((path.name, node.func.id))
            elif isinstance(node, ast.Import | ast.ImportFrom):
                names = [alias.name for alias in node.names] + [getattr(node, "module", None) or ""]
                imported += [(path.name, name) for name in names if name.split(".")[0] in CODE_FROM_FILES]
            elif isinstance(node, ast.keyword) and node.arg in ("allow_pickle", "shell"):
                arguments.append((path.name, node.arg))
    assert not calls and not arguments and set(imported) == set(EXCEPTIONS.items())


def test_a_stored_result_that_is_damaged_is_refused_in_one_line():
    with pytest.raises(InputError, match="persistent_load") as refused:
        objects.load(b"\x80\x04K\x01Q.")  # names an object outside of the file
    assert "\n" not in str(refused.value)
    with pytest.raises(InputError, match="5 bytes that are no digest follow"):
        objects.load(pickle.dumps([1.0]) + b"12345")


@pytest.mark.parametrize(
    "hostile",
    [os.system, eval, exec, getattr, print, subprocess.run, importlib.import_module, np.load, enable_float64],
)
def test_a_stored_result_runs_nothing(hostile):
    class Trap:
        def __reduce__(self):
            return hostile, ("1",)

    with pytest.raises(InputError, match="no result is made of"):
        objects.load(pickle.dumps(Trap()))


def test_a_stored_result_names_no_module_of_others():
    class Trap:
        def __reduce__(self):
            return objects._own_module, ("os",)

    with pytest.raises(InputError, match="none of this project's"):
        objects.load(pickle.dumps(Trap()))


@pytest.mark.parametrize(
    "tie",
    [
        "__import__('os').system('true')", "a.__class__", "().__class__.__bases__", "(lambda: 1)()", "[x for x in a]",
        "open('f')", "f'{a}'", "a if b else c", "{1: 2}", "a[0]", "print(a)", "getattr(a, 'b')", "sin.__globals__",
        "1+" * 20000 + "1", "(" * 5000 + "a" + ")" * 5000, "exp(a, where=b)", "'text'", "x := 3", "a; b",
    ],
)  # fmt: skip
def test_a_tie_reaches_no_attribute_no_import_and_no_statement(tie):
    with pytest.raises(InputError) as refused:
        names_in(tie, "mu")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", ["../evil.png", "/tmp/evil.png", "a/b.png", "..", "", "a\\b.png", "C:evil.png"])
def test_no_result_is_written_outside_its_folder(tmp_path, name):
    with pytest.raises(InputError, match="cannot be the name of a file in this folder"):
        publish(tmp_path / "out", {name: "", "report.json": "{}"}, force=False)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["../evil", "/tmp/evil", "a\\b", ".."])
def test_no_recording_is_written_outside_its_folder(tmp_path, name):
    recording = read_recording(ROOT / "calibration_data" / "examples" / "pulled_silicone" / "pull_1.csv")
    with pytest.raises(InputError, match="cannot be the name of a file"):
        recording_texts(replace(recording, name=name), tmp_path / "out")


STUDY_WITH_CODE = """schema = "pneusma-study/1"
name = "theirs"
design = "pneusma2"
[free]
wall_thickness = {{made = "continuous", from = 0.8, to = 1.6, unit = "mm"}}
[state.bent]
pressure = {{value = 30, unit = "kPa"}}
[objective.mine]
quantity = "function"
goal = "maximise"
file = "{file}"
"""


@pytest.mark.parametrize("way", ["above", "absolute", "link", "own"])
def test_a_study_executes_no_file_from_elsewhere(tmp_path, way):
    folder, outside = tmp_path / "study", tmp_path / "code.py"
    folder.mkdir()
    code = "from pathlib import Path\nPath(__file__).with_suffix('.ran').touch()\n"
    code += "def mine(states, parameters):\n    return states['bent'].only.curvature\n"
    outside.write_text(code)
    if way == "link":
        (folder / "code.py").symlink_to(outside)
    elif way == "own":
        (folder / "code.py").write_text(code)
    file = {"above": "../code.py", "absolute": str(outside)}.get(way, "code.py")
    (folder / "study.toml").write_text(STUDY_WITH_CODE.format(file=file))
    if way == "own":
        read_study(folder / "study.toml")
        return
    with pytest.raises(InputError, match="outside the study's folder, so it is not executed"):
        read_study(folder / "study.toml")
    assert not list(tmp_path.rglob("*.ran"))


@pytest.mark.parametrize("named", ["/etc/passwd", "../secret.txt", "../secret.toml"])
def test_a_campaign_that_names_a_file_of_others_does_not_quote_it(tmp_path, named):
    """A table of constants may lie elsewhere; what is no such table is refused, and its content is shown to nobody."""
    folder = tmp_path / "campaign"
    shutil.copytree(ROOT / "calibration_data" / "examples" / "wire", folder)
    for suffix in ("txt", "toml"):
        (tmp_path / f"secret.{suffix}").write_text("password hunter2\n")
    for sidecar in folder.glob("*.toml"):
        sidecar.write_text(re.sub(r'alloy = ".*?"', f'alloy = "{named}"', sidecar.read_text()))
    done = CliRunner().invoke(main, ["characterise", str(folder), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2 and done.stderr.count("\n") == 1, done.stderr
    assert "hunter2" not in done.stderr and "root:" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_tie_that_would_compute_for_ever_is_refused():
    assert names_in("9**9**9**9", "mu") == set()
    with pytest.raises(InputError, match="cannot be evaluated"):
        evaluate([("mu", "9**9**9**9")], {})


def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path, monkeypatch):
    write = Path.write_bytes

    def full(path, content):
        if path.name == "b.png":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="No space left"):
        publish(tmp_path / "out", {"a.txt": "a", "b.png": b"b", "report.json": "{}"}, force=False)
    assert list(tmp_path.iterdir()) == []


def test_results_that_were_there_survive_a_full_disk(tmp_path, monkeypatch):
    publish(tmp_path / "out", {"a.txt": "old", "report.json": "{}"}, force=False)
    monkeypatch.setattr(Path, "write_bytes", lambda *_: (_ for _ in ()).throw(OSError(errno.ENOSPC, "full")))
    with pytest.raises(InputError):
        publish(tmp_path / "out", {"a.txt": "new", "report.json": "{}"}, force=True)
    assert (tmp_path / "out" / "a.txt").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


CHAIN = """
import resource, sys
from pathlib import Path
import numpy as np
from fitting.sample.checkpoint import Header, write
from pneusma_jax.errors import InputError

chain, header = Path("out/chain.h5"), Header("of a target", {}, {})
write(chain, header, lambda file: file.create_dataset("draws", data=np.zeros(9)))
before = chain.read_bytes()
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    write(chain, header, lambda file: file.create_dataset("draws", data=np.arange(90_000.0)))
except InputError as error:
    print(error)
assert chain.read_bytes() == before and [path.name for path in chain.parent.iterdir()] == ["chain.h5"]
"""


def test_a_disk_that_refuses_half_of_a_chain_is_one_line_and_leaves_the_last_one(tmp_path):
    """The system refuses it: HDF5 itself would end the process when it cannot write what it still holds."""
    done = subprocess.run(
        [sys.executable, "-c", CHAIN], capture_output=True, text=True, cwd=tmp_path, env=os.environ | AT_ROOT
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "out/chain.h5: cannot be written here (File too large)\n" and done.stderr == ""


@pytest.mark.parametrize(
    "damage", [lambda b: b[: len(b) // 2], lambda b: b[:-9] + b"\x00" * 9, lambda b: b"", bytes.upper]
)
def test_a_damaged_cache_is_thrown_away_and_not_believed(tmp_path, damage):
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    try:
        call = lambda: program_cache.cached_program(lambda x: {"y": 2.0 * x}, "double")(jnp.arange(3.0))  # noqa: E731
        np.testing.assert_array_equal(call()["y"], [0.0, 2.0, 4.0])
        [stored] = (tmp_path / program_cache.FOLDER).glob("*.stablehlo")
        damaged = damage(stored.read_bytes())
        stored.write_bytes(damaged)
        np.testing.assert_array_equal(call()["y"], [0.0, 2.0, 4.0])
        assert stored.read_bytes() != damaged and program_cache._checked(stored.read_bytes())
    finally:
        jax.config.update("jax_compilation_cache_dir", before)


COMPUTE = """
import jax
jax.config.update("jax_compilation_cache_dir", {folder!r})
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
print(float(jax.jit(lambda x: (3.0 * x + 1.0).sum())(jax.numpy.arange(4.0))))
"""


def computed(folder: Path) -> str:
    """What a process of its own computes and prints, with its compiled programs in a folder."""
    code = [sys.executable, "-c", COMPUTE.format(folder=str(folder))]
    done = subprocess.run(code, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A folder with the compiled program."""
    folder = tmp_path_factory.mktemp("compiled")
    assert computed(folder) == "22.0\n"
    return folder


@pytest.mark.parametrize("damage", [lambda b: b[: len(b) // 2], lambda b: b[:20] + b"\x00" * 30 + b[50:], lambda b: b""])
def test_a_damaged_compiled_program_is_compiled_again(tmp_path, compiled, damage):
    folder = shutil.copytree(compiled, tmp_path / "damaged")
    stored = [path for path in folder.rglob("*") if path.is_file() and path.name.endswith("-cache")]
    assert stored
    for path in stored:
        path.write_bytes(damage(path.read_bytes()))
    assert computed(folder) == "22.0\n"


@pytest.mark.parametrize("now", [0.0, 946684800.0, 4102444800.0])
def test_a_clock_that_is_set_costs_no_more_than_time(tmp_path, monkeypatch, now):
    """1970, 2000 and 2100: programs on disk are found or made again, and results are replaced as ever."""
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path / "cache"))
    try:
        for clock in (time.time(), now, time.time()):
            monkeypatch.setattr(time, "time", lambda clock=clock: clock)
            call = program_cache.cached_program(lambda x: {"y": 3.0 * x}, "triple")
            np.testing.assert_array_equal(call(jnp.arange(3.0))["y"], [0.0, 3.0, 6.0])
            for path in (tmp_path / "cache").rglob("*.stablehlo"):
                os.utime(path, (clock, clock))
            publish(tmp_path / "out", {"a.txt": str(clock), "report.json": "{}"}, force=True)
            assert (tmp_path / "out" / "a.txt").read_text() == str(clock)
    finally:
        jax.config.update("jax_compilation_cache_dir", before)


def test_a_folder_that_may_not_be_written_to_is_one_line(tmp_path, monkeypatch):
    def refused(*_, **__):  # the superuser may write everywhere
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", refused)
    with pytest.raises(InputError, match=r"results cannot be written here \(.*: permission denied\)"):
        publish(tmp_path / "out", {"report.json": "{}"}, force=False)
    assert list(tmp_path.iterdir()) == []


def test_a_read_only_disk_is_one_line(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(tempfile, "mkdtemp", refuse)
    with pytest.raises(InputError, match="Read-only file system"):
        publish(tmp_path / "out", {"report.json": "{}"}, force=False)
    assert not (tmp_path / "out").exists()


PUBLISH = """
import importlib, sys, types
errors = types.ModuleType("pneusma_jax.errors")
errors.InputError = ValueError
sys.modules["pneusma_jax"], sys.modules["pneusma_jax.errors"] = types.ModuleType("pneusma_jax"), errors
sys.modules["fitting"], sys.modules["fitting.data"] = types.ModuleType("fitting"), types.ModuleType("fitting.data")
sys.modules["fitting.data"].__path__, sys.modules["pneusma_jax"].__path__ = [sys.argv[1]], [sys.argv[2]]
publish = importlib.import_module("fitting.data.publish")
print("ready", flush=True)
for version in range(10**6):
    publish.publish(sys.argv[3], {name: str(version) for name in ("a.png", "b.csv", "report.json")}, True)
"""


def test_a_kill_leaves_whole_results_of_one_version_or_none(tmp_path):
    rng, out = np.random.default_rng(1), tmp_path / "out"
    whole = 0
    for _ in range(40):
        with subprocess.Popen(
            [sys.executable, "-c", PUBLISH, ROOT / "fitting" / "data", ROOT / "pneusma_jax", out],
            stdout=subprocess.PIPE,
        ) as process:
            assert process.stdout.readline() == b"ready\n"
            time.sleep(rng.uniform(0.0, 0.02))
            process.kill()
        if (out / "report.json").exists():
            whole += 1
            assert len({path.read_text() for path in out.iterdir()}) == 1
    assert whole > 5


@pytest.mark.parametrize("name", ["Prüfung 1", "测试", "a" * 200, "with 'quotes' & <signs>", "-leading"])
def test_names_of_any_kind_are_read(tmp_path, name):
    file = tmp_path / name / f"{name}.csv"
    file.parent.mkdir()
    file.write_text("strain,stress_kPa\n" + "".join(f"{0.01 * k},{k}\n" for k in range(12)), encoding="utf-8")
    assert len(read_recording(file)) == 12


def test_a_path_that_is_too_long_is_one_line(tmp_path):
    done = pneusma("diagnose", "x" * 5000, "--out", str(tmp_path / "out"))
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "Traceback" not in done.stderr


def test_a_terminal_without_utf_8_gets_an_answer(tmp_path):
    (tmp_path / "test_é.csv").write_text("Sample é\nStrain (%),Stress (kPa)\n1,±\n", encoding="utf-8")
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii", "PYTHONCOERCECLOCALE": "0"}
    done = pneusma("import", str(tmp_path / "test_é.csv"), "--preview", **plain)
    assert done.returncode == 2 and "Traceback" not in done.stderr and done.stderr.count("\n") == 1
    code = "import click; from fitting.cli import LazyGroup\n" + (
        "@click.group(cls=LazyGroup, invoke_without_command=True)\ndef main(): print('3 \\xb1 1 kPa')\nmain(['--'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=os.environ | plain
    )
    assert done.stdout == "3 ? 1 kPa\n" and done.stderr == ""


def pneusma(*words: str, **environment: str) -> subprocess.CompletedProcess:
    """A command as a shell runs it."""
    return subprocess.run(
        [sys.executable, "-m", "fitting.cli", *words],
        capture_output=True,
        text=True,
        env=os.environ | environment,
    )


@pytest.mark.slow
def test_what_a_campaign_says_is_text_on_the_page_and_never_markup(tmp_path):
    folder, evil = tmp_path / "campaign", "<script>alert(1)</script>"
    folder.mkdir()
    strain = np.linspace(0.0, 0.6, 60)
    rows = "".join(f"{e},{30.0 * (1 + e - (1 + e) ** -2)}\n" for e in strain)
    (folder / "a&b.csv").write_text(f"# {evil}\nstrain,stress_kPa\n{rows}")
    (folder / "a&b.toml").write_text(
        f'kind = "elastomer"\nspecimen = "{evil}"\nreal = false\n[noise]\nstress_kPa = 0.5\n[source]\ncitation = "{evil}"\n'
    )
    (folder / "campaign.toml").write_text(f'title = "{evil}"\n')
    done = pneusma("characterise", str(folder), "--law", "neo_hookean", "--out", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<script>alert" not in page and "&lt;script&gt;" in page
