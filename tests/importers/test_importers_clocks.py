"""Clocks: every format of instruments is read, a column has one order of dates, and a clock is never lost."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_file, import_files, make_options
from fitting.data.importers.clocks import read_clock
from pneusma_jax.errors import InputError

STRAIN = np.linspace(0.0, 0.5, 30)
STRESS = 90.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
STEP = 4.0


def stamps(form, start, tail="", step=STEP):
    return [(start + timedelta(seconds=step * k)).strftime(form) + tail for k in range(30)]


def coupon(put, times, heading="Time", sep=";"):
    rows = "".join(f"{t}{sep}{100 * e:.3f}{sep}{s:.4f}\n" for t, e, s in zip(times, STRAIN, STRESS, strict=True))
    return put("a.csv", f"{heading}{sep}Strain (%){sep}Stress (kPa)\n{rows}")


NOON = datetime(2025, 5, 6, 11, 59, 30)
MIDNIGHT = datetime(2025, 5, 6, 23, 59, 30)
FORMATS = {
    "before and after noon": stamps("%I:%M:%S %p", NOON),
    "before and after midnight": stamps("%I:%M:%S %p", MIDNIGHT),
    "small letters with points": [t.replace("AM", "a.m.").replace("PM", "p.m.") for t in stamps("%I:%M:%S %p", NOON)],
    "a time zone": stamps("%Y-%m-%dT%H:%M:%S", MIDNIGHT, "+02:00"),
    "a time zone without colon": stamps("%Y-%m-%d %H:%M:%S.%f", MIDNIGHT, "-0430"),
    "a zone's name": stamps("%Y-%m-%d %H:%M:%S", MIDNIGHT, " UTC"),
    "minutes and seconds": [f"{int(4 * k) // 60:02d}:{int(4 * k) % 60:02d}" for k in range(30)],
    "hours from the sixtieth minute": [
        f"{s // 60:02d}:{s % 60:02d}" if s < 3600 else f"1:{s // 60 % 60:02d}:{s % 60:02d}" for s in range(3540, 3660, 4)
    ],
    "milliseconds after a colon": [f"12:0{k // 15}:{4 * k % 60:02d}:{7:03d}" for k in range(30)],
    "a short year": stamps("%m/%d/%y %H:%M:%S", MIDNIGHT),
    "a month's name": stamps("%d-%b-%Y %H:%M:%S", MIDNIGHT),
    "a comma after the date": stamps("%m/%d/%Y, %I:%M:%S %p", MIDNIGHT),
    "digits without marks": stamps("%Y%m%d %H:%M:%S", MIDNIGHT),
    "days in words": [f"1 day, 0:00:{k:02d}" for k in range(30)],
}  # fmt: skip


@pytest.mark.parametrize("name", FORMATS)
def test_a_clock_is_read(put, name):
    recording = import_file(coupon(put, FORMATS[name]))
    assert np.allclose(np.diff(recording.columns["time_s"]), 1.0 if name == "days in words" else STEP)
    assert any("is a clock" in note for note in recording.notices)


@pytest.mark.parametrize("start", [datetime(2025, 5, 6, 23, 59), datetime(2025, 5, 12, 23, 59), datetime(2025, 12, 31, 23, 59)])
@pytest.mark.parametrize("form", ["%m/%d/%Y %H:%M:%S", "%d/%m/%Y %H:%M:%S", "%d-%m-%y %H:%M:%S", "%m/%d/%y %I:%M:%S %p"])
def test_a_column_has_one_order_of_day_and_month(put, start, form):
    """Across midnight the other order would last a month; from the 12th to the 13th it fits a part of the rows."""
    recording = import_file(coupon(put, stamps(form, start)))
    assert np.allclose(np.diff(recording.columns["time_s"]), STEP) and "clock_as_logged" not in recording.columns
    said = [note for note in checks(recording) if "is a clock" in note]
    doubtful = len({order for order in ("%d/%m", "%m/%d") if other_order_fits(form, start, order)}) > 1
    assert bool(said) >= doubtful
    for note in said:
        assert "with which it lasts 116 s" in note and "write the dates as 2024-05-31" in note


def other_order_fits(form, start, order):
    try:
        for text in stamps(form, start):
            datetime.strptime(text[:5].replace("-", "/"), order)
    except ValueError:
        return False
    return True


def test_a_test_of_days_takes_the_order_that_lasts_days():
    assert read_clock(["01/02/2025", "02/02/2025", "03/02/2025"]).seconds == [0.0, 86400.0, 172800.0]
    assert read_clock(["02/01/2025", "02/02/2025", "02/03/2025"]).seconds == [0.0, 86400.0, 172800.0]


def test_dates_that_no_one_order_fits_are_no_clock():
    assert read_clock(["13/05/2025 10:00:00", "05/13/2025 10:00:01"]) is None
    assert read_clock(["10:00:00", "2025-05-13 10:00:01"]) is None


def test_a_step_of_the_time_zone_is_no_step_of_the_clock():
    assert read_clock(["2025-10-26T02:59:59+02:00", "2025-10-26T02:00:01+01:00"]).seconds == [0.0, 2.0]


@pytest.mark.parametrize(("heading", "factor"), [("Time (mm:ss)", 1.0), ("Time (hh:mm)", 60.0), ("Time", 1.0)])
def test_minutes_or_hours_as_the_heading_says(put, heading, factor):
    recording = import_file(coupon(put, [f"{k // 10:02d}:{k % 10 * 6:02d}" for k in range(30)], heading))
    assert np.allclose(np.diff(recording.columns["time_s"]), 6.0 * factor)
    asked = [note for note in checks(recording) if "minutes:seconds" in note]
    assert bool(asked) == (heading == "Time")
    if asked:
        other = import_file(recording.path, make_options(scales=["time=60"]))
        assert np.allclose(np.diff(other.columns["time_s"]), 360.0)


def test_a_number_of_days_since_1900(put):
    times = [f"{45678.75 + 4 * k / 86400:.9f}" for k in range(30)]
    recording = import_file(coupon(put, times, "Date/Time"))
    assert np.allclose(np.diff(recording.columns["time_s"]), STEP, atol=1e-3)


def test_a_clock_that_cannot_be_read_is_said_and_its_step_can_be_stated(put):
    path = coupon(put, [f"t{k}" for k in range(30)])
    (said,) = [note for note in checks(import_file(path)) if "cannot be read as a clock" in note]
    assert "'t0' in row 2" in said and "--interval" in said
    assert np.allclose(np.diff(import_file(path, make_options(interval_s=0.5)).columns["time_s"]), 0.5)
    rows = "".join(f"step {k},{20 + k},{0.001 * k},200\n" for k in range(20))
    path = put("b.csv", "Time,Temperature (°C),Strain (-),Stress (MPa)\n" + rows)
    with pytest.raises(InputError, match="fields of 'Time' are no numbers"):
        import_file(path)
    assert import_file(path, make_options(interval_s=2.0)).columns["time_s"][-1] == 38.0


@pytest.mark.parametrize("value", ["0", "17.5"])
def test_a_clock_that_stands_still_is_none(put, value):
    recording = import_file(coupon(put, [value] * 30, "Time (s)"))
    assert "time_s" not in recording.columns
    assert any(f"stands still at {float(value):g} s" in note for note in checks(recording))


def test_a_clock_cannot_be_constant():
    with pytest.raises(InputError, match="a time goes on; state the seconds between rows with --interval"):
        make_options(constants=["time_s=3"])


def test_a_long_column_has_one_reading_for_all_rows():
    texts = [(NOON + timedelta(seconds=k)).strftime("%d/%m/%Y %H:%M:%S") for k in range(5000)]
    clock = read_clock(texts)
    assert clock.seconds == [float(k) for k in range(5000)] and not clock.remedy


@pytest.mark.parametrize("heading", ["Date", "Datum", "Logged at", "Recorded"])
def test_a_clock_under_a_heading_that_names_no_time_is_read_and_said(put, heading):
    times = [(NOON + timedelta(seconds=STEP * k)).isoformat(sep=" ") for k in range(30)]
    recording = import_file(coupon(put, times, heading))
    assert np.allclose(recording.columns["time_s"], STEP * np.arange(30))
    assert any(f"check: column {heading!r} is a clock" in note for note in recording.notices)


def test_dates_that_spreadsheets_count_are_a_clock_where_a_column_of_dates_holds_them(put):
    times = [f"{45678.75 + 4 * k / 86400:.9f}" for k in range(30)]
    recording = import_file(coupon(put, times, "Date"))
    assert np.allclose(np.diff(recording.columns["time_s"]), 4.0, atol=1e-3)


def day_and_time(put, moments, day="%Y-%m-%d", time="%H:%M:%S", name="a.csv"):
    rows = [f"{m.strftime(day)},{m.strftime(time)},{0.01 * k:.4f},{2.0 * k:.4f}\n" for k, m in enumerate(moments)]
    return put(name, "Date,Time,Strain (-),Stress (kPa)\n" + "".join(rows))


def test_a_date_beside_a_time_of_day_is_one_clock(put):
    """A night without a reading, from 23:00 to 23:01 of the next day, is a day and not a minute."""
    first = datetime(2024, 5, 31, 23, 0)
    moments = [first + timedelta(seconds=k) + (k > 14) * timedelta(days=1, minutes=1) for k in range(30)]
    recording = import_file(day_and_time(put, moments))
    assert np.ptp(recording.columns["time_s"]) == 86400.0 + 60.0 + 29.0
    assert any("columns 'Date' and 'Time' are one clock" in note for note in recording.notices)
    assert not any("aside" in note for note in recording.notices)


def test_the_day_of_each_file_counts_where_files_are_joined(put):
    """Tests of a Monday and a Tuesday are a day apart, though their times of day are an hour apart."""
    paths = [
        day_and_time(put, [datetime(2024, 6, 3 + day, 12 + day, 0, k) for k in range(30)], name=f"{day}.csv")
        for day in (0, 1)
    ]
    (recording,) = import_files(paths, make_options(successive=True))
    assert recording.columns["time_s"][30] == 25 * 3600.0


def test_a_date_whose_order_is_open_leaves_the_time_of_day(put):
    recording = import_file(day_and_time(put, [datetime(2024, 6, 5, 12, 0, k) for k in range(30)], "%d/%m/%Y"))
    assert recording.columns["time_s"][0] == 43200.0


def test_dates_that_last_another_time_than_the_clock_are_said(put):
    """Times of minutes whose heading says seconds."""
    first = datetime(2024, 5, 31, 12, 0)
    rows = [
        f"{first + timedelta(minutes=k)},{k},{0.01 * k:.4f},{2.0 * k:.4f}\n" for k in range(30)
    ]
    recording = import_file(put("a.csv", "Date,Time (s),Strain (-),Stress (kPa)\n" + "".join(rows)))
    (said,) = [note for note in checks(recording) if "lasts" in note]
    assert "by 'Time (s)' the test lasts 29 s, and by 'Date' 1740 s" in said and "--map time=1" in said
    agreeing = put("b.csv", recording.path.read_text().replace("Time (s)", "Time (min)"))
    assert not [note for note in checks(import_file(agreeing)) if "lasts" in note]


@pytest.mark.parametrize(
    ("heading", "text", "asked"), [("Date", "{:%d %B}", True), ("Temperature", "hot", True), ("Operator", "AB", False), ("Date", "31 May", False)]
)
def test_a_column_of_text_that_a_quantity_or_changing_dates_head_is_to_be_checked(put, heading, text, asked):
    first = datetime(2024, 5, 31)
    rows = [f"{text.format(first - timedelta(days=k))},{k},{0.01 * k:.4f},{2.0 * k:.4f}\n" for k in range(30)]
    recording = import_file(put("a.csv", f"{heading},Time (s),Strain (-),Stress (kPa)\n" + "".join(rows)))
    (left,) = [note for note in recording.notices if "is text and was left out" in note]
    assert left.startswith("check: ") == asked and f"column {heading!r} is text and was left out (" in left


def test_a_date_and_a_time_of_day_in_cells_are_one_clock(put_sheet):
    """Spreadsheets hold a date as its midnight."""
    moments = [datetime(2024, 5, 31, 23, 59, 50) + timedelta(seconds=k) for k in range(30)]
    rows = [[m.replace(hour=0, minute=0, second=0), m.time(), 0.01 * k, 2.0 * k] for k, m in enumerate(moments)]
    recording = import_file(put_sheet("a.xlsx", [["Date", "Time", "Strain (-)", "Stress (kPa)"], *rows]))
    np.testing.assert_allclose(recording.columns["time_s"], np.arange(30.0))
    assert any("columns 'Date' and 'Time' are one clock" in note for note in recording.notices)


SPLIT = {
    "minutes and seconds": ("Min,Sec", 5.0, lambda t: f"{t // 60:.0f},{t % 60:.1f}"),
    "one name": ("Time (min),Time (s)", 5.0, lambda t: f"{t // 60:.0f},{t % 60:.1f}"),
    "a unit alone": ("Zeit [min],[s]", 5.0, lambda t: f"{t // 60:.0f},{t % 60:.1f}"),
    "milliseconds": ("Time (s),Time (ms)", 0.25, lambda t: f"{t // 1:.0f},{1e3 * (t % 1):.0f}"),
    "hours": ("Hours,Minutes,Seconds", 300.0, lambda t: f"{t // 3600:.0f},{t % 3600 // 60:.0f},{t % 60:.1f}"),
    "single hours": ("Hour,Min,Sec", 5400.0, lambda t: f"{t // 3600:.0f},{t % 3600 // 60:.0f},{t % 60:.1f}"),
    "letters": ("hh,mm,ss", 300.0, lambda t: f"{t // 3600:.0f},{t % 3600 // 60:.0f},{t % 60:.1f}"),
    "midnight": ("h,min,s", 300.0, lambda t: f"{(t + 82800) % 86400 // 3600:.0f},{t % 3600 // 60:.0f},{t % 60:.1f}"),
}  # fmt: skip


@pytest.mark.parametrize("name", SPLIT)
def test_a_clock_in_several_columns_is_one(put, name):
    """One of the columns had been taken for the whole clock, or none."""
    headings, step, form = SPLIT[name]
    recording = import_file(coupon(put, [form(step * k) for k in range(30)], headings, ","))
    np.testing.assert_allclose(np.diff(recording.columns["time_s"]), step)
    assert any("are one clock" in note for note in recording.notices)


def test_two_clocks_that_both_count_the_whole_time_are_not_one(put):
    times = [f"{4 * k / 60:.4f},{4 * k}" for k in range(30)]
    recording = import_file(coupon(put, times, "Time (min),Time (s)", ","))
    np.testing.assert_allclose(recording.columns["time_s"], 4.0 * np.arange(30), atol=0.01)
    assert not any("are one clock" in note for note in recording.notices)
