import pytest


@pytest.fixture
def put(tmp_path):
    """Writes a raw file of its own making and returns its path."""

    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
        return path

    return write


@pytest.fixture
def read(put):
    """Imports a text as the file of one recording, with options by name."""
    from fitting.data.importers import import_file, make_options

    def imported(text, **named):
        return import_file(put("a.csv", text), make_options(**named))

    return imported


@pytest.fixture
def put_sheet(tmp_path):
    """Writes rows as an Excel workbook, or a dictionary of them as its sheets."""
    import openpyxl

    def write(name, rows):
        book = openpyxl.Workbook()
        sheets = rows if isinstance(rows, dict) else {"Sheet": rows}
        book.remove(book.active)
        for title, lines in sheets.items():
            sheet = book.create_sheet(title)
            for row in lines:
                sheet.append(list(row))
        book.save(tmp_path / name)
        return tmp_path / name

    return write


@pytest.fixture
def follow(tmp_path):
    """Runs `pneusma import`, and again with what a refusal or a note advises, word for word."""
    import re
    import shlex

    from click.testing import CliRunner

    from fitting.cli.import_ import import_command
    from fitting.data.recordings import read_campaign

    def options_in(text):
        """Options that a message names with a value, as a person would copy them."""
        text = re.sub(r"\.\.\.", "", text)
        found = re.findall(r"--(?:map|unit|scale|constant|subtract|dimension|slack|kind|sheet|specimen) "
                           r"(?:[\w]+=)?(?:'[^']*'|\"[^\"]*\"|[\w.%/+-]+)|--compression|--tension", text)  # fmt: skip
        return [word for option in found for word in shlex.split(option)]

    def run(*args):
        out = tmp_path / f"out_{len(list(tmp_path.glob('out_*')))}"
        result = CliRunner().invoke(import_command, [*map(str, args), "--out", str(out)])
        recordings = read_campaign(out).recordings if result.exit_code == 0 and result.exception is None else []
        return (str(result.exception) if result.exception else result.output), recordings

    run.options_in = options_in
    return run
