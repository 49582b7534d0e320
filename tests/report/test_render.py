"""One report as text, page, JSON and files: units of `report.py` and `render.py`."""

import json
import re
from html.parser import HTMLParser
from importlib import resources

import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.figure import Figure

from fitting.report import render
from fitting.report.report import Code, Picture, Points, Report, Section
from fitting.report.table import WIDTH, Cell, Table, numeric_columns, table_text

NAME = 'pull <1> & "2" \'3\''
"""A name with every character that HTML knows."""


class Page(HTMLParser):
    """Texts by tag, and whether every tag is closed."""

    VOID = {"meta", "img"}

    def __init__(self, text):
        super().__init__()
        self.texts, self.open, self.classes = {}, [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        if tag not in self.VOID:
            self.open.append(tag)
            self.texts.setdefault(tag, []).append("")
        self.classes += [(tag, value) for key, value in attributes if key == "class"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        for tag in self.open:
            self.texts[tag][-1] += data


def drawn():
    figure = Figure(figsize=(1.0, 1.0))
    figure.subplots().plot([0.0, 1.0])
    return figure


def report(*blocks, **others):
    return Report("Title", "what was done", ["It agrees."], [Section("Part", blocks)], **others)


def test_what_one_types_is_set_as_code_on_a_page_and_escaped():
    assert render.typed("say `a <b>` or `c`") == "say <code>a &lt;b&gt;</code> or <code>c</code>"
    assert Page(render.page(report("type `pneusma effects`"))).texts["code"] == ["pneusma effects"]


def test_every_text_of_a_page_is_escaped():
    found = Report(
        NAME, NAME, [NAME], warnings=[NAME], footer=NAME, window=NAME,
        sections=[Section(NAME, [
            NAME, Points([NAME]), Code(NAME), Picture("p", NAME, drawn), Section(NAME, [NAME]),
            Table([NAME], [[NAME], [Cell(NAME, NAME, "good")]], NAME),
        ])],
    )  # fmt: skip
    page = render.page(found)
    assert NAME not in page and "<1>" not in page
    texts = Page(page).texts
    for tag in ("title", "h1", "h2", "h3", "li", "pre", "figcaption", "th", "caption", "span", "small", "footer"):
        assert [text.strip() for text in texts[tag]] == [NAME], tag
    assert [text.strip() for text in texts["p"]] == [NAME] * 5 and texts["td"] == [NAME, 2 * NAME]


def test_a_page_holds_its_figures_and_fetches_nothing():
    page = render.page(report(Picture("curve", "A curve.", drawn)))
    assert page.count("data:image/svg+xml;base64,") == 1
    assert not re.search(r"""(src|href)\s*=\s*["'](?!data:)""", page)
    assert page.index('class="verdict"') < page.index("<figure>")


def test_simulated_data_are_called_so_in_text_and_page():
    for real, said in ((False, True), (True, False), (None, False)):
        found = report("Words.", real=real)
        assert ("SIMULATED data" in render.text(found)) is said
        assert ("simulated data, not measured" in render.page(found)) is said


@pytest.mark.parametrize("block", ["", Points([]), Table(["a", "b"], []), Section("Inner", [Points([])])])
def test_a_section_with_nothing_to_show_is_left_out(block):
    assert "Part" not in render.text(report(block)) and "Part" not in render.page(report(block))
    beside = report(block, "Words.")
    assert "Part" in render.text(beside) and "<table>" not in render.page(beside)
    assert "Inner" not in render.page(beside) and "<ul>" not in render.page(beside)


def test_a_table_without_rows_is_no_text():
    assert table_text(Table(["a", "b"], [])) == "  a  b"
    assert table_text(Table(["", ""], [["x", "1"]])) == "  x  1"


def test_rows_must_fit_the_header():
    with pytest.raises(ValueError, match="must have 2 cells each"):
        Table(["a", "b"], [["1"]])


def test_numbers_are_aligned_to_the_right_and_words_to_the_left():
    rows = [["x", "1.5 ± 0.1", "good", "n/a"], ["a long name", "(-2 ± 1)e-07", "at bound", ""]]
    lines = table_text(Table(["name", "value", "remark", "error"], rows), indent=0).splitlines()
    assert lines == [
        "name                value  remark    error",
        "x               1.5 ± 0.1  good        n/a",
        "a long name  (-2 ± 1)e-07  at bound",
    ]
    page = Page(render.page(report(Table(["name", "value", "remark", "error"], rows))))
    assert page.classes.count(("td", "number")) == 4 and page.classes.count(("th", "number")) == 2


def test_a_column_of_numbers_may_have_a_word_and_an_empty_one_is_of_words():
    rows = [[str(k), str(k), "cold" if k == 0 else str(10.0**k), ""] for k in range(5)]
    assert numeric_columns(Table(["a", "b", "c", "d"], rows)) == [False, True, True, False]
    assert numeric_columns(Table(["a", "b"], [["x", "kPa"], ["y", "1"]])) == [False, False]


def test_the_chosen_row_is_marked():
    table = Table(["a", "b"], [["x", "1"], ["y", "2"]], chosen=1)
    assert table_text(table).splitlines() == ["  a  b", "  x  1", "* y  2"]
    assert Page(render.page(report(table))).classes.count(("tr", "chosen")) == 1


def test_long_words_wrap_and_long_names_stay_whole():
    name, words = "a_name_of_a_recording_that_is_far_longer_than_a_column", " ".join(["word"] * 40)
    table = Table(["name", "why", "number"], [[name, words, "1.0"]])
    lines = table_text(table).splitlines()
    assert name in lines[1] and all(len(line) <= WIDTH for line in lines)
    assert sum(line.count("word") for line in lines) == 40 and lines[1].endswith("1.0")
    assert name in render.page(report(table)) and 'class="long"' in render.page(report(table))
    assert name in render.text(report(f"{name} {name} {name}"))


def test_a_note_stands_below_its_table_and_a_section_inside_another_below_its_heading():
    text = render.text(report(Section("Inner", [Table(["a"], [["1"]], "A note."), Code("run\n  it")])))
    assert text.endswith("Part\n  Inner\n    a\n    1\n    A note.\n    run\n      it")
    assert "<h3>Inner</h3>" in render.page(report(Section("Inner", ["Words."])))


def test_text_draws_nothing_and_files_draw_each_figure_once():
    calls = []

    def draw():
        calls.append(1)
        return drawn()

    found = report(Picture("curve", "A curve.", draw), files=lambda: {"more.csv": "a\n1\n"})
    assert "curve" not in render.text(found) and not calls
    documents = render.documents(found)
    assert set(documents) == {"report.json", "report.html", "curve.png", "more.csv"} and calls == [1]
    assert documents["curve.png"].startswith(b"\x89PNG")


def test_json_has_plain_numbers_and_null_for_what_is_not_finite():
    content = {"a": np.float64(1.5), "b": float("nan"), "c": [np.inf, np.int64(2)], "d": (np.bool_(True),), "e": "±"}
    text = render.json_text(content)
    assert json.loads(text, parse_constant=pytest.fail) == {"a": 1.5, "b": None, "c": [None, 2], "d": [True], "e": "±"}
    assert text.endswith("}\n") and "±" in text


def test_arrays_are_lists_in_json():
    content = {"a": np.array([1.0, np.nan]), "b": np.array([[1, 2]]), "c": jnp.asarray([True]), "d": np.array(2.5)}
    assert json.loads(render.json_text(content)) == {"a": [1.0, None], "b": [[1, 2]], "c": [True], "d": 2.5}


@pytest.mark.parametrize("name", ["report.json", "report.html", "curve.png"])
def test_a_file_that_would_be_lost_under_the_name_of_another_is_an_error(name):
    found = report(Picture("curve", "A curve.", drawn), files=lambda: {name: "mine"})
    with pytest.raises(ValueError, match=name):
        render.documents(found)


@pytest.mark.parametrize("block", [None, 1.0, ["words"]])
def test_what_is_no_block_is_refused_where_a_section_is_made(block):
    with pytest.raises(TypeError, match="blocks of a report"):
        Section("Part", ["words", block])


def test_templates_are_in_the_package():
    names = {entry.name for entry in resources.files("fitting.report").joinpath("templates").iterdir()}
    assert {"page.html", "blocks.html", "style.css"} <= names
