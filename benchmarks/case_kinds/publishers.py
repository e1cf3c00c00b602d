"""Several publishers on one topic, messages out of order, and stamps coarser than the sampling."""

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from case_kinds.checks import check_rate, check_tone, check_values
from case_kinds.clocks import sine
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.logs import (
    NS,
    START_NS,
    Entry,
    Topic,
    as_json,
    assert_sine,
    double,
    json_topic,
    last_doubles,
    plain,
    read_back,
    stamped,
    stamped_double,
    write_log,
)
from case_kinds.product import MismatchError, Product, channel, count, expect

# One topic, two channels


def _turns(names: Sequence[Topic], every: int, order: Sequence[int] | None = None) -> Callable[[Path], Path]:
    """400 samples of a 5 Hz sine at 100 Hz; publishers take turns; stored in the order given, else of time."""

    def write(folder: Path) -> Path:
        entries = []
        for index in range(400):
            topic, value = names[(index // every) % len(names)], sine(index, 100, 5)
            data = as_json(x=value) if topic.encoding == "json" else double(value)
            entries.append(Entry(topic, START_NS + index * 10_000_000, data, index))
        path = write_log(folder / "turns.mcap", [entries[index] for index in order or range(400)], chunk_size=2000)
        rows = sorted((log_ns, data) for _, log_ns, data in read_back(path))
        values = [json.loads(data)["x"] if data[:1] == b"{" else np.frombuffer(data[4:])[0] for _, data in rows]
        assert_sine(np.arange(400) / 100, np.array(values), 5, 1.0)
        return path

    return write


def _check_whole(product: Product, path: Path) -> None:
    document = product.info(path)
    entry = check_rate(product, path, "x", 100, samples=400)
    expect(abs(document["duration_s"] - 4.0) <= 0.011, f"{document['duration_s']:g} s instead of 4")
    expect(not count(entry["gaps"]), f"{count(entry['gaps'])} gaps instead of none")
    expect(not count(entry.get("breaks")), f"{count(entry.get('breaks'))} breaks instead of none")
    check_tone(product, path, "x", 5)
    check_values(product, path, "x", np.array([sine(index, 100, 5) for index in range(400)]))


def _publishers(offset_ns: int, second_rate_hz: float, *, one_after_other: bool) -> Callable[[Path], Path]:
    """Write 5 Hz from one publisher and 8 Hz of half its size from another, at the same times."""

    def write(folder: Path) -> Path:
        first = [Entry(plain(), START_NS + i * 10_000_000, double(sine(i, 100, 5))) for i in range(400)]
        second = [
            Entry(plain(publisher=1), START_NS + offset_ns + round(i * NS / second_rate_hz),
                  double(0.5 * sine(i, second_rate_hz, 8)))
            for i in range(round(4 * second_rate_hz))
        ]  # fmt: skip
        both = first + second
        if not one_after_other:
            both.sort(key=lambda entry: entry.log_ns)
        path = write_log(folder / "publishers.mcap", both, chunk_size=3000)
        assert len(read_back(path)) == len(both)
        return path

    return write


def _check_publishers(total: int) -> Check:
    """Two are told, or all are in the order of their log times: 8 s never come out of 4."""

    def check(product: Product, path: Path) -> None:
        document = product.info(path)
        expect(abs(document["duration_s"] - 4.0) <= 0.03, f"{document['duration_s']:g} s instead of 4")
        entries = [each for each in document["channels"] if each["name"].startswith("/s")]
        told = any(count(each.get("publishers")) == 2 for each in entries) or product.tells(
            r"(two|2) (publishers|channels)"
        )
        merged = (
            len(entries) == 1 and entries[0]["samples"] == total and abs((entries[0]["rate_hz"] or 0) - 200) < 0.2
        )
        expect(told or merged, "neither told as two publishers nor 200 Hz in log-time order")
        kept = sum(each["samples"] for each in entries)
        expect(kept in (total, total // 2) or told, f"{kept} samples of {total}")

    return check


def topics_of_two_channels() -> list[Case]:
    """Several channels hold one topic, or messages lie in the file out of order."""
    kind = "one_topic_two_channels"
    second, third = plain(publisher=1), plain(publisher=2)
    number = {"x": {"type": "number"}}
    window = [
        index for start in range(0, 400, 8) for index in (*range(start + 5, start + 8), *range(start, start + 5))
    ]
    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("taking_turns", given(kind, "taking_turns.mcap"), _check_whole),
            ("one_channel_later_half_stored_first",
             given(kind, "one_channel_later_half_stored_first.mcap"), _check_whole),
            ("later_half_stored_first_of_two",
             _turns([plain(), second], 50, [*range(200, 400), *range(200)]), _check_whole),
            ("three_take_turns", _turns([plain(), second, third], 7), _check_whole),
            ("recorder_changed_encoding", _turns([plain(), json_topic("/s", number, 1)], 200), _check_whole),
            ("newest_first", _turns([plain()], 400, range(399, -1, -1)), _check_whole),
            ("written_by_threads", _turns([plain()], 400, window), _check_whole),
            ("two_publishers_at_once", _publishers(5_000_000, 100, one_after_other=True), _check_publishers(800)),
            ("two_publishers_interleaved", _publishers(5_000_000, 100, one_after_other=False),
             _check_publishers(800)),
            ("two_publishers_of_two_rates", _publishers(3_300_000, 40, one_after_other=True), _check_publishers(560)),
        )
    ]  # fmt: skip


# Stamps coarser than the sampling


def _coarse(rate_hz: float, tick_ns: int, samples: int, hz: float, *, header: bool = False) -> Callable[[Path], Path]:
    """A sine and noise of a hundredth at a true rate, stamped by a clock that moves in ticks."""

    def write(folder: Path) -> Path:
        noise = 0.01 * np.random.default_rng(7).standard_normal(samples)
        entries = []
        for index in range(samples):
            true_ns = round(index * NS / rate_hz)
            stamp, value = START_NS + true_ns // tick_ns * tick_ns, sine(index, rate_hz, hz) + noise[index]
            if header:
                # The recorder's own clock is fine, but what it stamps came over a bus in bursts.
                late = START_NS + (true_ns // 20_000_000 + 1) * 20_000_000
                entries.append(Entry(stamped(), late, stamped_double(stamp, value)))
            else:
                entries.append(Entry(plain(), stamp, double(value)))
        path = write_log(folder / "coarse.mcap", entries)
        _, values = last_doubles(path, "/s")
        assert_sine(np.arange(samples) / rate_hz, values, hz, 1.0, error=0.02)
        return path

    return write


def _coarse_csv(rate_hz: float, digits: int, samples: int, hz: float) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        rows = (f"{index / rate_hz:.{digits}f},{sine(index, rate_hz, hz, 0.1):.6f}" for index in range(samples))
        path = folder / "coarse.csv"
        path.write_text("\n".join(["time [s],x [m/s^2]", *rows]) + "\n")
        return path

    return write


def _check_coarse(rate_hz: float, samples: int, hz: float, tick_s: float) -> Check:
    def check(product: Product, path: Path) -> None:
        # A tick at each end is what the stamps leave open.
        within = max(2 * tick_s * rate_hz / samples, 1e-4)
        check_rate(product, path, "x", rate_hz, samples=samples, within=within)
        document = check_tone(product, path, "x", hz)
        rms = channel(document, "x")["rms"]
        if rms is not None and abs(rms - math.sqrt(0.5)) > 0.05:
            raise MismatchError(f"RMS {rms:.3g} instead of 0.707")

    return check


def coarse_stamps() -> list[Case]:
    """Several samples share a stamp, or the stamps' steps alternate."""
    kind = "stamps_coarser_than_sampling"
    rows: list[tuple[str, Callable[[Path], Path | None], float, int, float, float]] = [
        ("104Hz_stamped_in_10ms", given(kind, "104Hz_stamped_in_10ms.mcap"), 104, 6240, 10, 0.01),
        ("1660Hz_stamped_in_1ms", given(kind, "1660Hz_stamped_in_1ms.mcap"), 1660, 4980, 100, 0.001),
        ("1344Hz_stamped_in_1ms", _coarse(1344, 1_000_000, 4032, 100), 1344, 4032, 100, 0.001),
        ("3333Hz_stamped_in_1ms", _coarse(3333, 1_000_000, 13_332, 420), 3333, 13_332, 420, 0.001),
        ("windows_tick_at_100Hz", _coarse(100, 15_625_000, 3000, 7), 100, 3000, 7, 0.015625),
        ("119Hz_header_in_10ms", _coarse(119, 10_000_000, 5950, 31, header=True), 119, 5950, 31, 0.01),
        ("1kHz_csv_to_a_hundredth", _coarse_csv(1000, 2, 8000, 120), 1000, 8000, 120, 0.01),
        ("256Hz_csv_to_a_thousandth", _coarse_csv(256, 3, 5120, 33), 256, 5120, 33, 0.001),
        ("whole_seconds_at_50Hz", _coarse(50, NS, 6000, 4), 50, 6000, 4, 1.0),
    ]
    cases = []
    for name, write, rate_hz, samples, hz, tick_s in rows:
        check = _check_coarse(rate_hz, samples, hz, tick_s)
        answers = {"--rate": (f"{rate_hz:g}",), "sample_rate_hz": (f"{rate_hz:g}",), "--stamp": ("log", "publish")}
        cases.append(Case(kind=kind, name=name, write=write, check=check, may_refuse="asking", answers=answers))
    return cases


def cases() -> list[Case]:
    """Every case about several publishers and coarse stamps."""
    return [*topics_of_two_channels(), *coarse_stamps()]
