"""CSV tables and times of files: text among numbers, clock times, day numbers, units, tones in the lowest lines."""

import datetime as dt
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import scipy.io

from case_kinds.checks import check_rate, check_tone, check_values
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.logs import START_NS, Entry, assert_sine, double, plain, write_log
from case_kinds.product import MismatchError, Product, channel, expect
from case_kinds.universal_kinds import WAVE, unit_files, unit_of

RATE_HZ, SAMPLES = 200.0, 400
TIMES_S = np.arange(SAMPLES) / RATE_HZ
NOON = dt.datetime(2024, 5, 1, 12, 0, 0, tzinfo=dt.UTC)
GRAVITY = 9.80665
Row = Callable[[int], str]

assert_sine(TIMES_S, WAVE, 7.0, 1.0)


# CSV that was refused


def _csv(
    head: str, row: Row, *, encoding: str = "utf-8", newline: str = "\n", samples: int = SAMPLES
) -> Callable[[Path], Path]:
    """Write a table of the 7 Hz sine, each row by its number."""

    def write(folder: Path) -> Path:
        path = folder / "table.csv"
        text = newline.join([*head.split("\n"), *(row(index) for index in range(samples))]) + newline
        path.write_bytes(text.encode(encoding))
        return path

    return write


def _at(index: int, pattern: str = "%Y-%m-%dT%H:%M:%S.%f", digits: int = 6, begin: dt.datetime = NOON) -> str:
    stamp = begin + dt.timedelta(microseconds=5000 * index)
    text = stamp.strftime(pattern)
    return text if digits == 6 else text[: digits - 6]


def _check_csv(name: str, *told: str, amplitude: float = 1.0) -> Check:
    def check(product: Product, path: Path) -> None:
        check_rate(product, path, name, RATE_HZ, samples=SAMPLES)
        check_values(product, path, name, amplitude * WAVE, within=1e-4)
        if told:
            product.told(*told)

    return check


def csv_refused() -> list[Case]:
    """Ordinary tables that were refused."""
    kind = "csv_refused"
    evening = NOON.replace(hour=23, minute=59, second=59)
    states = ("idle", "run", "hold")

    def german(number: float, digits: int = 5) -> str:
        return f"{number:.{digits}f}".replace(".", ",")

    rows = [
        ("comma_at_line_ends", given(kind, "comma_at_line_ends.csv"), _check_csv("a")),
        ("iso_times", given(kind, "iso_times.csv"), _check_csv("ax")),
        ("text_column", _csv("time [s],gait,ax", lambda i: f"{TIMES_S[i]:.4f},{states[i // 150]},{WAVE[i]:.5f}"),
         _check_csv("ax", "gait")),
        ("text_first_and_last",
         _csv("serial_no,time_s,ax,remark", lambda i: f"IMU-7,{TIMES_S[i]:.4f},{WAVE[i]:.5f},"),
         _check_csv("ax", "serial_no")),
        ("quoted_text_with_commas",
         _csv('time [s],"mounting","ax [g]"', lambda i: f'{TIMES_S[i]:.4f},"left, rear",{WAVE[i]:.5f}'),
         _check_csv("ax", "mounting", amplitude=GRAVITY)),
        ("german_with_semicolon_at_line_ends",
         _csv("Zeit [s];Beschl [m/s²];", lambda i: f"{german(TIMES_S[i], 4)};{german(WAVE[i])};", encoding="latin-1",
              newline="\r\n"),
         _check_csv("Beschl")),
        ("iso_with_offset_and_blank",
         _csv("timestamp;ax", lambda i: f"{_at(i, '%Y-%m-%d %H:%M:%S.%f')}+02:00;{WAVE[i]:.5f}"), _check_csv("ax")),
        ("iso_without_zone_in_ms",
         _csv("Time,ax", lambda i: f"{_at(i, digits=3)},{WAVE[i]:.5f}", encoding="utf-8-sig"), _check_csv("ax")),
        ("clock_times_over_midnight",
         _csv("time,ax", lambda i: f"{_at(i, '%H:%M:%S.%f', 3, evening)},{WAVE[i]:.5f}"), _check_csv("ax")),
        ("nanoseconds_since_1970",
         _csv("timestamp,ax", lambda i: f"{START_NS + 5_000_000 * i},{WAVE[i]:.5f}"), _check_csv("ax")),
        ("t_ms", _csv("t_ms,ax", lambda i: f"{5 * i},{WAVE[i]:.5f}"), _check_csv("ax")),
        ("vendor_lines_and_tabs",
         _csv("Device:\tVM31\nOperator:\n\nTime_s\tax\nsec\tm/s2", lambda i: f"{TIMES_S[i]:.3f}\t{WAVE[i]:.5f}"),
         _check_csv("ax")),
        ("text_cell_amid_numbers",
         _csv("time [s],ax,gps", lambda i: f"{TIMES_S[i]:.4f},{WAVE[i]:.5f},{'no fix' if i % 3 else '48.1'}"),
         _check_csv("ax", "gps|no fix")),
    ]  # fmt: skip
    answers = {"time_unit": ("s", "ms", "ns"), "--rate": ("200",), "sample_rate_hz": ("200",)}
    return [Case(kind=kind, name=name, write=write, check=check, answers=answers) for name, write, check in rows]


# Time in days, and other units that no name tells


def _mat(name: str, times: np.ndarray) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = folder / "times.mat"
        scipy.io.savemat(path, {name: times[None, :], "x": WAVE[None, :]})
        found = scipy.io.loadmat(path)
        assert np.array_equal(found[name][0], times)
        assert_sine(TIMES_S, found["x"][0], 7.0, 1.0)
        return path

    return write


def _npz(name: str, times: np.ndarray) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = folder / "times.npz"
        np.savez(path, **{name: times, "x": WAVE})
        return path

    return write


def _check_times(product: Product, path: Path) -> None:
    check_rate(product, path, "x", RATE_HZ, samples=SAMPLES)
    check_tone(product, path, "x", 7.0)


DAYS = ("days", "day", "d")


def time_in_days() -> list[Case]:
    """Day numbers, and bare vectors in another unit than seconds."""
    kind = "time_in_days"
    days = TIMES_S / 86_400
    rows: list[tuple[str, Callable[[Path], Path | None], tuple[str, ...]]] = [
        ("datenum", given(kind, "datenum.mat"), ("datenum", "matlab", *DAYS)),
        ("serial_date", _csv("time,x", lambda i: f"{45_413.5 + days[i]:.10f},{WAVE[i]:.5f}"), ("excel", *DAYS)),
        ("milliseconds", _mat("t", 5.0 * np.arange(SAMPLES)), ("ms",)),
        ("datenum_in_npz", _npz("time", 739_008.5 + days), ("datenum", "matlab", *DAYS)),
        (
            "excel_date_column",
            _csv("Date;x", lambda i: f"{45_413.25 + days[i]:.11f};{WAVE[i]:.5f}"),
            ("excel", *DAYS),
        ),
        ("days_from_zero", _mat("t", days), DAYS),
        ("microseconds", _mat("time", 5000.0 * np.arange(SAMPLES)), ("us",)),
        ("t_us_by_name", _mat("t_us", 5000.0 * np.arange(SAMPLES)), ("us",)),
        ("posix_ms_in_npz", _npz("timestamp", START_NS // 10**6 + 5 * np.arange(SAMPLES)), ("ms",)),
        ("posix_seconds", _mat("time", START_NS / 1e9 + TIMES_S), ("s",)),
        ("minutes_in_csv", _csv("time [min],x", lambda i: f"{TIMES_S[i] / 60:.9f},{WAVE[i]:.5f}"), ("min",)),
    ]
    cases = []
    for name, write, units in rows:
        answers = {"time_unit": units, "--time-unit": units, "--rate": ("200",), "sample_rate_hz": ("200",)}
        cases.append(
            Case(kind=kind, name=name, write=write, check=_check_times, may_refuse="asking", answers=answers)
        )
    return cases


# A tone in lines that aren't judged


def _tone(rate_hz: float, seconds: float, tones: Sequence[tuple[float, float]], *, offset: float = 0.0,
          log: bool = False) -> Callable[[Path], Path]:  # fmt: skip
    """Write tones (Hz, amplitude), an offset, and noise of a hundredth."""

    def write(folder: Path) -> Path:
        samples = round(rate_hz * seconds)
        time = np.arange(samples) / rate_hz
        values = offset + 0.01 * np.random.default_rng(2).standard_normal(samples)
        for hz, amplitude in tones:
            values += amplitude * np.sin(2 * np.pi * hz * time)
        if len(tones) == 1:
            assert_sine(time, values, *tones[0], error=0.02)
        if log:
            entries = [Entry(plain("/a"), START_NS + round(time[i] * 1e9), double(values[i])) for i in range(samples)]
            return write_log(folder / "tone.mcap", entries)
        path = folder / "tone.csv"
        rows = (f"{at:.6f},{value:.5f}" for at, value in zip(time, values, strict=True))
        path.write_text("\n".join(["time [s],x [m/s^2]", *rows]) + "\n")
        return path

    return write


NOT_JUDGED = (
    r"(not|aren't|isn't|wasn't|weren't|can't be|nothing is) judged|un-?judged|noise bandwidths"
    r"|(below|above|under|slower than) [\d.]+ Hz[^.]{0,60}(judged|told|peak)|no peak is looked for"
)


def _check_tones(name: str, *tones_hz: float) -> Check:
    def check(product: Product, path: Path) -> None:
        document = product.ask("psd", path)
        peaks = [peak["frequency_hz"] for peak in channel(document, name)["peaks"]]
        spacing = document["frequency_hz"][1] - document["frequency_hz"][0]
        for hz in tones_hz:
            found = any(abs(peak - hz) <= spacing for peak in peaks)
            # Told is a band of lines that weren't judged, not that there's nothing.
            told = product.tells(NOT_JUDGED)
            expect(
                found or told, f"{hz:g} Hz isn't among the peaks {peaks or '(none)'}, and no unjudged band is told"
            )

    return check


def tone_in_lines_that_are_not_judged() -> list[Case]:
    """A tone so low, or a record so short, that it lies in the first lines."""
    kind = "tone_in_lines_that_are_not_judged"
    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("twenty_hertz", given(kind, "twenty_hertz.csv"), _check_tones("a", 20)),
            ("five_hertz_of_100", _tone(100, 5, [(5, 1)]), _check_tones("x", 5)),
            ("over_gravity", _tone(400, 5, [(18, 0.5)], offset=GRAVITY), _check_tones("x", 18)),
            ("low_beside_a_high_one", _tone(1000, 4, [(40, 1), (230, 0.5)]), _check_tones("x", 40, 230)),
            ("near_half_the_rate", _tone(400, 5, [(192, 1)]), _check_tones("x", 192)),
            ("two_seconds_in_a_log", _tone(1000, 2, [(35, 1)], log=True), _check_tones("x", 35)),
            ("a_minute_at_1_Hz", _tone(50, 60, [(0.25, 1)]), _check_tones("x", 0.25)),
        )
    ]


# Units


def _unit_csv(label: str, *, encoding: str = "utf-8", beside: str = "") -> Callable[[Path], Path]:
    head = f"time [s],a [{label}]" + (f",b [{beside}]" if beside else "")

    def row(index: int) -> str:
        second = f",{100 * WAVE[index]:.5f}" if beside else ""
        return f"{TIMES_S[index]:.4f},{WAVE[index]:.6f}{second}"

    return _csv(head, row, encoding=encoding)


def _check_unit(name: str, unit: str, scale: float) -> Check:
    """Values are in SI, whatever the label; a scale of one sine's amplitude."""

    def check(product: Product, path: Path) -> None:
        units, columns = product.columns(path)
        found = [key for key in columns if key.rstrip(']"').endswith(name)] or list(columns)
        amplitude = float(np.sqrt(2) * np.std(columns[found[0]]))
        expect(
            abs(amplitude - scale) <= 2e-3 * scale,
            f"amplitude {amplitude:.6g} {units[found[0]]} instead of {scale:g} {unit}",
        )
        expect(units[found[0]].replace(" ", "") == unit, f"unit {units[found[0]]} instead of {unit}")
        listed = unit_of(product, path, name)
        expect(listed in (unit, "g" if scale == GRAVITY else unit), f"info lists {listed} instead of {unit}")

    return check


def _check_contradiction(name: str, *allowed: tuple[str, float], told: str) -> Check:
    """One of several readings, each a unit and the amplitude in it, is taken and told."""

    def check(product: Product, path: Path) -> None:
        units, columns = product.columns(path)
        [found] = _ending(columns, name)
        amplitude, unit = float(np.sqrt(2) * np.std(columns[found])), units[found].replace(" ", "")
        fits = any(each == unit and abs(amplitude - scale) <= 2e-3 * scale for each, scale in allowed)
        expect(
            fits,
            f"amplitude {amplitude:.6g} {unit} instead of one of {allowed}",
        )
        product.told(told)

    return check


def units_of_acceleration() -> list[Case]:
    """Units as the field writes them."""
    kind = "units_of_acceleration"
    cases = [
        Case(kind=kind, name="ms^-2_csv", write=given(kind, "ms^-2.csv"), check=_check_unit("a", "m/s^2", GRAVITY))
    ]
    labels = {
        "m_over_s_over_s": ("m/s/s", 1.0), "ms-2": ("ms-2", 1.0), "m_s^-2": ("m s^-2", 1.0),
        "superscripts": ("m·s⁻²", 1.0), "Gs": ("Gs", GRAVITY), "G": ("G", GRAVITY), "gn": ("gn", GRAVITY),
        "mm_s2": ("mm/s2", 1e-3), "in_s^2": ("in/s^2", 0.0254),
        "m_s**2": ("m/s**2", 1.0), "m_sec2": ("m/sec2", 1.0), "milli_g": ("mg", 1e-3 * GRAVITY),
    }  # fmt: skip
    for name, (label, scale) in labels.items():
        check = _check_unit("a", "m/s^2", scale)
        cases.append(Case(kind=kind, name=name, write=_unit_csv(label), check=check))
    # Words beside a unit may be understood, or leave the channel without a unit, which is told, or be asked about.
    for name, label in (("g's", "g's"), ("g_rms", "g rms"), ("g_peak", "g pk")):
        check = _check_contradiction("a", ("m/s^2", GRAVITY), ("1", 1.0), told="unit|a")
        cases.append(Case(kind=kind, name=name, write=_unit_csv(label), check=check, may_refuse="asking",
                          answers={"units": ("a:g",)}))  # fmt: skip
    files = unit_files()[kind]
    checks: dict[str, tuple[Check, bool]] = {
        "acceleration_ms^-2": (_check_unit("1", "m/s^2", 1.0), False),
        "gs_of_type_12": (_check_unit("1", "m/s^2", GRAVITY), False),
        "lb_of_a_force": (_check_unit("1", "N", 4.4482216), False),
        "lbs_of_a_force": (_check_unit("1", "N", 4.4482216), False),
        "ms-2_of_type_12": (_check_unit("1", "m/s^2", 1.0), False),
        # A kilogram of force has been written for centuries; a metre of acceleration is a mistake.
        "kg_of_a_force": (_check_contradiction("1", ("N", GRAVITY), ("kg", 1.0), told=CONTRADICTS), True),
        "m_of_an_acceleration": (_check_contradiction("1", ("m", 1.0), ("m/s^2", 1.0), told=CONTRADICTS), True),
    }
    for name, write in files.items():
        check, contradicts = checks[name]
        cases.append(Case(kind=kind, name=name, write=write, check=check, may_refuse="yes" if contradicts else "no"))
    return cases


CONTRADICTS = r"ordinate|type|contradict|kgf|kilogram"


def _check_beside(acceleration: str, other: str, others: Sequence[tuple[str, float]]) -> Check:
    """The acceleration is read; the other is read too, without unit or rightly, and it's told."""

    def check(product: Product, path: Path) -> None:
        product.info(path)
        units, columns = product.columns(path)
        [right] = _ending(columns, acceleration)
        amplitude = float(np.sqrt(2) * np.std(columns[right]))
        unit = units[right].replace(" ", "")
        expect(
            unit == "m/s^2" and abs(amplitude - 1) < 2e-3, f"acceleration of {amplitude:g} {unit} instead of 1 m/s^2"
        )
        product.ask("psd", path)
        if other:
            _check_other(product, units, columns, other, others)

    return check


def _check_other(
    product: Product,
    units: dict[str, str],
    columns: dict[str, np.ndarray],
    other: str,
    others: Sequence[tuple[str, float]],
) -> None:
    found = _ending(columns, other)
    if not found:
        raise MismatchError(f"the other channel isn't among {', '.join(columns)}")
    amplitude, unit = float(np.sqrt(2) * np.std(columns[found[0]])), units[found[0]]
    pairs = [(each, scale) for each, scale in others if each == unit]
    expect(bool(pairs), f"the other channel is in {unit!r}")
    expect(abs(amplitude - pairs[0][1]) <= 2e-3 * pairs[0][1], f"the other has an amplitude of {amplitude:g} {unit}")
    if unit == "1":
        product.told(r"unit")


def _ending(columns: dict[str, np.ndarray], ending: str) -> list[str]:
    return [key for key in columns if key.endswith(ending)] or [key for key in columns if ending in key][:1]


def _latin1_two(folder: Path) -> Path:
    """Write µm and m/s² in latin-1."""
    return _unit_csv("m/s²", encoding="latin-1", beside="µm")(folder)


def units_that_are_not_known() -> list[Case]:
    """A unit that isn't known, beside an acceleration."""
    kind = "units_that_are_not_known"
    files = unit_files()[kind]
    none = [("1", 100.0)]
    turning = [("1", 1.0), ("rpm", 1.0), ("rad/s", 2 * np.pi / 60)]
    rows = [
        ("rpm_beside_acceleration", files["rpm_beside_acceleration"], _check_beside("2:+1", "1:+1", turning)),
        ("latin1_superscript", files["latin1_superscript"], _check_beside("1:+1", "", [])),
        ("eu_beside_acceleration", files["eu_beside_acceleration"], _check_beside("2:+1", "1:+1", [("1", 1.0)])),
        ("latin1_beside_nonsense", files["latin1_beside_nonsense"], _check_beside("2:+1", "1:+1", [("1", 1.0)])),
        ("counts", _unit_csv("m/s^2", beside="counts"), _check_beside("a", "b", none)),
        ("microstrain", _unit_csv("m/s^2", beside="µε"), _check_beside("a", "b", [("1", 1e-4), *none])),
        ("torque_as_Nm", _unit_csv("m/s2", beside="Nm"), _check_beside("a", "b", [("N m", 100.0), *none])),
        ("volts_spelt", _unit_csv("m/s2", beside="Volts"), _check_beside("a", "b", [("V", 100.0), *none])),
        ("decibels", _unit_csv("m/s2", beside="dB(A)"), _check_beside("a", "b", none)),
        ("latin1_micrometres", _latin1_two, _check_beside("a", "b", [("m", 1e-4), *none])),
        ("a_question_mark", _unit_csv("m/s^2", beside="???"), _check_beside("a", "b", none)),
    ]
    return [Case(kind=kind, name=name, write=write, check=check) for name, write, check in rows]


def cases() -> list[Case]:
    """Every case about tables, times of files, tones and units."""
    return [
        *csv_refused(), *time_in_days(), *tone_in_lines_that_are_not_judged(), *units_of_acceleration(),
        *units_that_are_not_known(),
    ]  # fmt: skip
