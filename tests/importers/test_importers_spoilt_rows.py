"""Rows that are spoilt: cut off, or with words among their numbers. Each is named with its row and column."""

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_file, import_tests, make_options

STRAIN = np.linspace(0.0, 60.0, 24)
STRESS = 0.15 * (1.0 + STRAIN / 100.0 - (1.0 + STRAIN / 100.0) ** -2)
ROWS = [f"{0.2 * k:.1f},{a:.4f},{s:.6f}" for k, (a, s) in enumerate(zip(STRAIN, STRESS, strict=True))]
HEAD = "Zeit [s],Tensile strain [%],Tensile stress [MPa]"


def text(*rows, head=HEAD, mark=","):
    return "\n".join([head, *rows]).replace(",", mark)


def test_a_word_among_numbers_is_named_with_its_row_and_column(put):
    recording = import_file(put("a.csv", text(*ROWS[:9], "1.8,20.0,broken", *ROWS[10:])))
    (said,) = checks(recording)
    assert "1 field of column 'Tensile stress [MPa]' is no number ('broken' in row 11): missing" in said
    assert np.isnan(recording.columns["stress_kPa"]).sum() == 1 and len(recording) == 24


def test_several_words_are_named_with_their_rows(put):
    rows = [*ROWS[:9], "1.8,oops,0.05", *ROWS[10:15], "3.0,stop,0.06", *ROWS[16:]]
    (said,) = checks(import_file(put("a.csv", text(*rows))))
    assert "2 fields of column 'Tensile strain [%]' are no numbers ('oops' in row 11, 'stop' in row 17)" in said


@pytest.mark.parametrize(
    ("rest", "words"),
    [("4.8,61.", "has 2 of 3 fields ('4.8,61.')"), ("4.8", "has 1 of 3 fields"), ("4.8,61.0000,0.1", "fewer decimals than all others"), ("4.8,61.0000,0", "fewer decimals")],
)
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_a_row_in_which_the_file_was_cut_off_is_left_out_and_named(put, rest, words, mark):
    recording = import_file(put("a.csv", text(*ROWS, rest, mark=mark)))
    (said,) = checks(recording)
    assert said.startswith("check: row 26, the last one,") and "cut off?" in said and "left out" in said
    assert words.replace(",", mark).replace("\t", "\\t") in said
    assert len(recording) == 24 and recording.columns["time_s"][-1] == pytest.approx(4.6)


@pytest.mark.parametrize("rest", ["7.000e+0", "7.000e+", "7.000e", "7.000", "7.0", "7"])
def test_a_number_that_was_cut_off_in_its_exponent_is_left_out(put, rest):
    rows = [f"{0.2 * k:.1f},{a:.4f},{s:.3e}" for k, (a, s) in enumerate(zip(STRAIN, STRESS, strict=True))]
    recording = import_file(put("a.csv", text(*rows, f"4.8,61.0000,{rest}")))
    (said,) = checks(recording)
    assert "row 26, the last one," in said and "digits of an exponent" in said and len(recording) == 24
    whole = import_file(put("b.csv", text(*rows, "4.8,61.0000,1.300e-01")))
    assert len(whole) == 25 and not checks(whole)


def test_a_number_with_fewer_decimals_than_any_other_is_left_out(put):
    """Others have four to six decimals, as programs write that round and drop zeros."""
    rows = [f"{0.2 * k:.1f},{a:.4f},{s:.{4 + k % 3}f}" for k, (a, s) in enumerate(zip(STRAIN, STRESS, strict=True))]
    recording = import_file(put("a.csv", text(*rows, "4.8,61.0000,0.1")))
    (said,) = checks(recording)
    assert "fewer decimals than all others" in said and len(recording) == 24


def test_a_last_field_that_is_blank_is_named_and_the_rest_of_its_row_kept(put):
    recording = import_file(put("a.csv", text(*ROWS, "4.8,61.0000,")))
    (said,) = checks(recording)
    assert "row 26" in said and "blank last field" in said and len(recording) == 25


@pytest.mark.parametrize("ending", ["", "\n", "\n\n", "\nEnd of data\n"])
def test_a_whole_last_row_is_no_cut(put, ending):
    recording = import_file(put("a.csv", text(*ROWS) + ending))
    assert len(recording) == 24 and not checks(recording)


def test_blank_fields_that_other_rows_have_too_are_no_cut(put):
    rows = [f"{row},{22.0 if k % 3 else ''}".rstrip(",") for k, row in enumerate(ROWS)] + ["4.8,61.0000,0.130000"]
    recording = import_file(put("a.csv", text(*rows, head=HEAD + ",Temperature (C)")), make_options(kind="elastomer"))
    assert len(recording) == 25 and not checks(recording)


def test_tests_of_unequal_length_side_by_side_are_no_cut(put):
    rows = [f"{row},{row}" for row in ROWS[:-1]] + ROWS[-1:]
    found = import_tests(put("a.csv", text(*rows, head=f"{HEAD},{HEAD}")))
    assert [len(recording) for recording in found] == [24, 23] and not any(map(checks, found))


def test_numbers_without_a_fixed_count_of_decimals_are_no_cut(put):
    rows = [f"{0.2 * k:.4g},{a:.4g},{s:.4g}" for k, (a, s) in enumerate(zip(STRAIN, STRESS, strict=True))] + ["4.8,61,0.18"]
    recording = import_file(put("a.csv", text(*rows)))
    assert len(recording) == 25 and not checks(recording)


WHOLE = [f"{0.2 * k:.1f},{a:.4f},{57 * k}" for k, a in enumerate(STRAIN)]


@pytest.mark.parametrize("rest", ["12", "1", "13", "131"])
def test_a_whole_number_whose_last_digits_are_cut_off_is_left_out(put, rest):
    """The rows above lead to expect about 1368; these are first digits of it, and no end of line follows."""
    options = make_options(slack="keep", units=["stress=kPa"])
    recording = import_file(put("a.csv", text(*WHOLE, f"4.8,61.0000,{rest}")), options)
    (said,) = [note for note in checks(recording) if "cut off" in note]
    assert said.startswith("check: row 26, the last one,") and "without an end of line" in said and "left out" in said
    assert said.endswith("if it is whole, end the file with an end of line")
    assert len(recording) == 24
    ended = import_file(put("b.csv", text(*WHOLE, f"4.8,61.0000,{rest}", "")), options)
    assert len(ended) == 25  # a written end of line: the row is whole, and the specimen broke


@pytest.mark.parametrize("rest", ["1368", "1309", "0", "7", "900"])
def test_a_last_whole_number_that_is_no_part_of_the_one_expected_is_kept(put, rest):
    recording = import_file(put("a.csv", text(*WHOLE, f"4.8,61.0000,{rest}")), make_options(units=["stress=kPa"]))
    assert len(recording) == 25 and not any("end of line" in note for note in recording.notices)


@pytest.mark.parametrize(("mark", "decimal"), [(",", "."), (";", ",")])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_number_without_fixed_decimals_whose_last_ones_are_cut_off_is_left_out(put, mark, decimal, sign):
    numbers = [f"{sign * 0.0121 * k:.4g}" for k in range(24)]
    numbers[3] = f"{0.1 * sign:g}"  # others have as few decimals
    rows = [f"{0.2 * k:.4g},{sign * 0.7 * k:.4g},{x}" for k, x in enumerate(numbers)]
    whole = text(*rows, f"4.8,{sign * 16.8:.4g},{0.2 * sign:g}").replace(",", mark).replace(".", decimal)
    recording = import_file(put("a.csv", whole), make_options(kind="elastomer"))
    (said,) = [note for note in checks(recording) if "cut off" in note]
    assert "without an end of line" in said and len(recording) == 24


FULL = [f"{0.1 * k!r},{0.3 * float(np.log1p(k))!r}" for k in range(1, 24)]


def test_digits_that_numbers_of_full_precision_lack_spoil_no_row(put):
    whole = f"2.4,{0.3 * np.log1p(24):.12f}"
    recording = import_file(put("a.csv", text(*FULL, whole, head="Strain (-),Stress (MPa)")), make_options(kind="elastomer"))
    assert len(recording) == 24 and not any("cut off" in check for check in checks(recording))
    cut = import_file(put("b.csv", text(*FULL, whole[:7], head="Strain (-),Stress (MPa)")), make_options(kind="elastomer"))
    assert len(cut) == 23 and any("was the file cut off" in check for check in checks(cut))


FALLING = [repr(float(np.sin(np.pi * x))) for x in np.linspace(0.013, 1.0, 60)]


def pulled_back(put, *last, first=FALLING[0], end=""):
    """Strain and stress of a coupon that is pulled and returns; the last stress is 1.2246467991473532e-16 MPa."""
    numbers = [first, *FALLING[1:-1], *last]
    strain = [repr(float(x)) for x in np.linspace(0.013, 1.0, 60)]
    rows = [f"{a},{b}" for a, b in zip(strain, numbers, strict=False)]
    path = put("a.csv", text(*rows, head="Strain (-),Stress (MPa)") + end)
    return import_file(path, make_options(kind="elastomer"))


@pytest.mark.parametrize("last", ["1.2246467", "1.224646799147353", "1.2246467991473532e-1"])
@pytest.mark.parametrize("first", [FALLING[0], "0.0", "0.04"])
def test_a_number_that_lost_its_exponent_is_left_out(put, last, first):
    """It was kept as 1.22 MPa. One short number above it, such as 0.0, does not change that."""
    recording = pulled_back(put, last, first=first)
    (said,) = [check for check in checks(recording) if "cut off" in check]
    assert "row 61, the last one," in said and len(recording) == 59 and recording.columns["stress_kPa"].max() < 1001.0


def test_a_short_number_below_numbers_of_full_precision_is_left_out_unless_it_stands_above(put):
    assert len(pulled_back(put, "0.05", first="0.0")) == 59
    assert len(pulled_back(put, "0.05", first="0.0", end="\n")) == 60
    assert len(pulled_back(put, "0.0", first="0.0")) == 60


def test_harmless_digits_are_missed_where_a_number_does_not_go_on(put):
    """Each of these lacks digits below 1e-6 MPa. The stress above is 0.05 MPa, after steps of 0.05 MPa."""
    assert len(pulled_back(put, "0.00123456789")) == 60
    assert len(pulled_back(put, "0.46123456789")) == 59
    assert len(pulled_back(put, "1.2246467991473532e-16")) == 60 == len(pulled_back(put, "1.2246467991473532e-16", end="\n"))


@pytest.mark.parametrize(("first", "count"), [("0.00013862943611198906", 24), ("1.3862943611198906e-05", 23)])
def test_harmless_digits_are_missed_where_a_number_may_lack_an_exponent(put, first, count):
    rows = [f"{0.1 * k!r},{2.0 * float(np.log1p(k))!r}" for k in range(1, 23)]
    path = put("a.csv", text(f"0.05,{first}", *rows, f"2.4,{2.0 * np.log1p(23):.12f}", head="Strain (-),Stress (MPa)"))
    assert len(import_file(path, make_options(kind="elastomer"))) == count
