"""Clocks that are set back or forward, and stamps that are no time."""

import json
import math
from collections.abc import Callable, Iterable, Sequence
from itertools import accumulate
from pathlib import Path

import numpy as np

from case_kinds.checks import check_rate, check_tone
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.logs import (
    NS,
    START_NS,
    Entry,
    as_json,
    assert_sine,
    double,
    json_topic,
    last_doubles,
    plain,
    proto_class,
    proto_file,
    proto_topic,
    read_back,
    stamped,
    stamped_double,
    write_log,
)
from case_kinds.product import Product, RefusalError, UntoldError, channel, count, expect

NO_TIME = (
    r"no time|not a time|isn't a time|is zero|of zero|zero stamp|1970|left out|unset|(are|were) no times|aren't times"
    r"|stamp[^.]{0,80}(ignored|dropped|replaced|not used|instead)|clock was set|break"
)


def sine(index: int, rate_hz: float, hz: float, phase: float = 0.0) -> float:
    """Sample of a sine of amplitude one."""
    return math.sin(2 * math.pi * hz * index / rate_hz + phase)


# A stamp that is zero


def _stamped_log(
    bad: Iterable[int], *, rate_hz: float, samples: int, hz: float, bad_stamp_ns: Callable[[int], int] = lambda _: 0
) -> Callable[[Path], Path]:
    """Header stamps 3 ms before the log's, but for some that are no time."""
    chosen = set(bad)

    def write(folder: Path) -> Path:
        entries = []
        for index in range(samples):
            stamp = START_NS + round(index * NS / rate_hz)
            data = stamped_double(bad_stamp_ns(index) if index in chosen else stamp, sine(index, rate_hz, hz))
            entries.append(Entry(stamped(), stamp + 3_000_000, data))
        path = write_log(folder / "stamps.mcap", entries)
        times, values = last_doubles(path, "/s")
        assert_sine(times, values, hz, 1.0)
        return path

    return write


def _check_without(rate_hz: float, samples: int, bad: int, hz: float, name: str = "x") -> Check:
    def check(product: Product, path: Path) -> None:
        document = product.info(path)
        entry = channel(document, name)
        found = entry["rate_hz"]
        expect(
            found is not None and abs(found - rate_hz) <= 1e-3 * rate_hz, f"rate {found} Hz instead of {rate_hz:g}"
        )
        # A message whose stamp is no time may be placed by its log time, or left out.
        allowed = range(samples - bad, samples + 1)
        expect(entry["samples"] in allowed, f"{entry['samples']} samples instead of {samples} less {bad} or fewer")
        span = samples / rate_hz
        expect(abs(document["duration_s"] - span) <= max(0.01 * span, (bad + 2) / rate_hz),
               f"{document['duration_s']:g} s instead of {span:g}")  # fmt: skip
        check_tone(product, path, name, hz)
        product.ask("psd", path, "--start", f"{0.2 * span:g}", "--end", f"{0.9 * span:g}")
        product.told(NO_TIME)

    return check


def _json_nan(folder: Path) -> Path:
    """Write stamps in seconds as bare numbers in JSON, three of them null, as NaN becomes."""
    topic = json_topic("/s", {"timestamp": {"type": "number"}, "x": {"type": "number"}})
    entries = []
    for index in range(1500):
        stamp = START_NS + index * 4_000_000
        seconds = None if index in (300, 301, 900) else stamp / NS
        entries.append(Entry(topic, stamp + 2_000_000, as_json(timestamp=seconds, x=sine(index, 250, 30))))
    path = write_log(folder / "nulls.mcap", entries, compress=True)
    rows = [json.loads(data) for _, _, data in read_back(path)]
    assert sum(row["timestamp"] is None for row in rows) == 3
    assert_sine(np.arange(1500) / 250, np.array([row["x"] for row in rows]), 30, 1.0)
    return path


def _protobuf_unset(folder: Path) -> Path:
    """Leave the Timestamp submessage out of the first two messages and of one amid."""
    text = [
        ("Stamp", [("seconds", 1, "int64", "implicit"), ("nanos", 2, "int32", "implicit")]),
        ("Imu", [("timestamp", 1, "Stamp", "implicit"), ("x", 2, "double", "implicit")]),
    ]
    descriptors = proto_file("imu.proto", text, "proto3")
    message_type, topic = proto_class(descriptors, "Imu"), proto_topic("/s", "Imu", descriptors)
    entries = []
    for index in range(3000):
        stamp = START_NS + index * 1_000_000
        message = message_type(x=sine(index, 1000, 50))
        if index not in (0, 1, 1700):
            message.timestamp.seconds, message.timestamp.nanos = divmod(stamp, NS)
        entries.append(Entry(topic, stamp + 500_000, message.SerializeToString()))
    path = write_log(folder / "unset.mcap", entries)
    rows = [message_type.FromString(data) for _, _, data in read_back(path)]
    assert sum(not row.HasField("timestamp") for row in rows) == 3
    assert_sine(np.arange(3000) / 1000, np.array([row.x for row in rows]), 50, 1.0)
    return path


def _zero_in_csv(folder: Path) -> Path:
    """Write a table of times since 1970 with one time of zero."""
    lines = ["time [s],x [m/s^2]"]
    for index in range(2000):
        time = 0.0 if index == 700 else 1_700_000_000 + index / 200
        lines.append(f"{time:.3f},{sine(index, 200, 20):.6f}")
    path = folder / "zero.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def stamps_of_zero() -> list[Case]:
    """One or a few stamps are no time."""
    kind = "a_stamp_that_is_zero"
    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("amid", given(kind, "amid.mcap"), _check_without(400, 2000, 1, 20)),
            ("first", given(kind, "first.mcap"), _check_without(400, 2000, 1, 20)),
            ("last", _stamped_log([1999], rate_hz=400, samples=2000, hz=20), _check_without(400, 2000, 1, 20)),
            ("first_five_since_boot",
             _stamped_log(range(5), rate_hz=100, samples=1000, hz=7,
                          bad_stamp_ns=lambda index: 12_340_000_000 + index * 10_000_000),
             _check_without(100, 1000, 5, 7)),
            ("seven_scattered",
             _stamped_log([3, 40, 41, 500, 777, 1200, 2900], rate_hz=833, samples=3000, hz=61),
             _check_without(833, 3000, 7, 61)),
            ("all_ones",
             _stamped_log([450], rate_hz=50, samples=900, hz=3, bad_stamp_ns=lambda _: 2**31 * NS - 1),
             _check_without(50, 900, 1, 3)),
            ("null_in_json", _json_nan, _check_without(250, 1500, 3, 30)),
            ("unset_in_protobuf", _protobuf_unset, _check_without(1000, 3000, 3, 50)),
            ("zero_in_csv", _zero_in_csv, _check_without(200, 2000, 1, 20)),
        )
    ]  # fmt: skip


# A clock that is set


def _stretches(lengths: Sequence[int], rate_hz: float, first_s: Callable[[int], float]) -> list[tuple[int, float]]:
    """Sample number and stamp (s) of each sample; `first_s` gives where each stretch begins."""
    begins = [0, *accumulate(lengths)]
    return [
        (begins[stretch] + index, first_s(stretch) + index / rate_hz)
        for stretch, length in enumerate(lengths)
        for index in range(length)
    ]


def _episodes(
    lengths: Sequence[int], rate_hz: float, hz: float, first_s: Callable[[int], float], *, header: bool = False
) -> Callable[[Path], Path]:
    """Write a sine that goes on while the stamps start again; a header's stamps, or the log's own."""

    def write(folder: Path) -> Path:
        entries = []
        for number, stamp_s in _stretches(lengths, rate_hz, first_s):
            value, stamp = sine(number, rate_hz, hz), round(stamp_s * NS)
            if header:
                # The recorder's clock goes on.
                entries.append(
                    Entry(stamped(), START_NS + round(number * NS / rate_hz), stamped_double(stamp, value))
                )
            else:
                entries.append(Entry(plain(), stamp, double(value)))
        path = write_log(folder / "episodes.mcap", entries, close=header)
        _, values = last_doubles(path, "/s")
        assert_sine(np.arange(sum(lengths)) / rate_hz, values, hz, 1.0)
        return path

    return write


def _episodes_csv(lengths: Sequence[int], rate_hz: float, hz: float) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        rows = _stretches(lengths, rate_hz, lambda _: 0.0)
        lines = ["time [s],x [m/s^2]", *(f"{time:.4f},{sine(number, rate_hz, hz):.6f}" for number, time in rows)]
        path = folder / "episodes.csv"
        path.write_text("\n".join(lines) + "\n")
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        assert np.sum(np.diff(table[:, 0]) < 0) == len(lengths) - 1
        return path

    return write


def _check_breaks(lengths: Sequence[int], rate_hz: float, hz: float, *, forward: bool = False) -> Check:
    breaks, longest = len(lengths) - 1, max(lengths)

    def check(product: Product, path: Path) -> None:
        document = product.info(path)
        entry = check_rate(product, path, "x", rate_hz, samples=sum(lengths))
        expect(entry["jitter_s"] <= 1e-3 / rate_hz, f"jitter {entry['jitter_s']:.3g} s instead of 0")
        found = count(entry.get("breaks"))
        gaps = count(entry.get("gaps")) if forward else 0
        said = product.tells(rf"\b{breaks} (clock )?(break|time|step|jump|set)")
        expect(breaks in (found, found + gaps) or said, f"{found} breaks and {gaps} gaps instead of {breaks} breaks")
        expect(not entry["duplicates"], f"{entry['duplicates']} duplicates instead of none")
        stretch = entry.get("longest_stretch_s")
        least, most = (longest - 1) / rate_hz, longest / rate_hz
        expect(stretch is None or least * 0.999 <= stretch <= most * 1.001,
               f"longest stretch {stretch} s instead of {most:g}")  # fmt: skip
        recorded = sum(lengths) / rate_hz
        shortest = recorded - len(lengths) / rate_hz
        in_span = 0.99 * shortest <= document["duration_s"] <= 1.01 * recorded
        expect(in_span or forward, f"duration {document['duration_s']:g} s; {recorded:g} s were recorded")
        _check_spectrum(product, path, hz, most)
        if stretch is None:
            raise UntoldError("right, but the longest stretch isn't told")

    return check


def _check_spectrum(product: Product, path: Path, hz: float, longest_s: float) -> None:
    """No average crosses a break; a record too short for any may say so."""
    try:
        document = check_tone(product, path, "x", hz)
    except RefusalError:
        return
    expect(document["segment_s"] <= longest_s * 1.001, f"averages of {document['segment_s']:g} s over breaks")


EIGHT_TO_SIXTY = [8 + (index * 37) % 53 for index in range(59)] + [60]
"""Sixty stretches of 8 to 60 samples in an order that nobody would call even."""


def clocks_set() -> list[Case]:
    """The clock is set back or forward, at stretches of any length."""
    kind = "clock_set_back_after_few_samples"
    mixed = [40 + (index * 71) % 361 for index in range(30)]
    few = [25] * 40
    long = [10_000, 12_500, 10_100, 11_000]
    uneven = [15, 3000, 15, 2000, 800]

    def jumping(stretch: int) -> float:
        # An hour forward at every other stretch and back again.
        begun = START_NS / NS + sum(uneven[:stretch]) / 500
        return begun + 3600.0 * (stretch % 2)

    def slightly_back(stretch: int) -> float:
        # Each time the clock is set back by four samples of the stretch just ended.
        return START_NS / NS + stretch * (25 - 4) / 50

    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("twelve_samples_each", given(kind, "twelve_samples_each.mcap"), _check_breaks([12] * 60, 10, 1)),
            ("eight_to_sixty", _episodes(EIGHT_TO_SIXTY, 10, 1, lambda _: 0.1), _check_breaks(EIGHT_TO_SIXTY, 10, 1)),
            ("simulated_time_at_200_Hz",
             _episodes(mixed, 200, 17, lambda _: 0.005, header=True), _check_breaks(mixed, 200, 17)),
            ("back_by_four_samples", _episodes(few, 50, 6, slightly_back, header=True), _check_breaks(few, 50, 6)),
            ("long_stretches_at_1_kHz",
             _episodes(long, 1000, 80, lambda _: START_NS / NS), _check_breaks(long, 1000, 80)),
            ("an_hour_forward_and_back",
             _episodes(uneven, 500, 40, jumping, header=True), _check_breaks(uneven, 500, 40, forward=True)),
            ("episodes_in_csv", _episodes_csv([120] * 20, 100, 9), _check_breaks([120] * 20, 100, 9)),
        )
    ]  # fmt: skip


def cases() -> list[Case]:
    """Every case about stamps that are no time and clocks that are set."""
    return [*stamps_of_zero(), *clocks_set()]
