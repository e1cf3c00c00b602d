"""A wrong time of one message or one row, in logs and tables: all others are at their own times, and it's told."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from chladni.cli.main import main
from chladni.io.log import Log, open_log
from chladni.io.log import open as open_any
from chladni.signals.arrays import Whole
from tests.io.clock.stamp_makers import stamps as stamps_of
from tests.make_logs import IMU, START_NS, LogMaker, imu, write_numbers, write_stored

PERIOD_NS = 10_000_000
#: Where a stamp may claim to be, in periods from the first one: early, at another's, between two, and outside.
CLAIMS = [-1234.5, -1.3, 0.078, 7.0, 33.4, 77.95, 119.5, 140.2, 2000.0]


def jittered(samples: int, jitter: float, seed: int) -> Whole:
    scatter = np.random.default_rng(seed).uniform(-jitter, jitter, samples)
    return START_NS + np.rint((np.arange(samples) + scatter) * PERIOD_NS).astype(np.int64)


def write_stamped(path: Path, stamps_ns: Whole, logged_ns: Whole) -> None:
    with LogMaker(path) as log:
        channel = log.ros2("/s", "sensor_msgs/msg/Imu", IMU)
        for number, (stamp_ns, log_ns) in enumerate(zip(stamps_ns.tolist(), logged_ns.tolist(), strict=True)):
            log.write(channel, imu(stamp_ns, (number, 0, 0)), log_ns)


def require_others_right(log: Log, name: str, wrong: int, samples: int, *, start_ns: int = START_NS) -> None:
    """Require that all numbers are at their own places, but that of the wrong time, which is there, or told."""
    series, info = log.read([name]), log.info()
    first = round((series.start_time_ns - start_ns) / PERIOD_NS)
    values = series.values[0]
    there = np.isfinite(values)
    np.testing.assert_array_equal(values[there], first + np.flatnonzero(there))
    lost = set(range(samples)) - set(values[there].astype(int).tolist())
    assert lost <= {wrong}
    if lost:
        told = " ".join((*info.findings, *(one.what for one in info.damage)))
        assert "contradicts the count" in told or "is no time" in told or "the stamp of another" in told
        assert "1 " in told
    # Seconds count from the first sample that has a time.
    assert abs(info.start_time_ns - start_ns) < 0.5 * PERIOD_NS
    assert info.duration_s == pytest.approx(samples * PERIOD_NS * 1e-9, abs=0.5e-9 * PERIOD_NS)


@pytest.mark.parametrize("bits", [range(first, first + 7) for first in range(0, 61, 7)])
def test_a_bit_flipped_in_a_stamp(tmp_path: Path, bits: Sequence[int]) -> None:
    """Nanoseconds of the stamp up to 2^29, and seconds up to 2^30."""
    for bit in bits[: 61 - bits[0]]:
        rng = np.random.default_rng(bit)
        samples = int(rng.integers(20, 200))
        stamps, wrong = jittered(samples, 0.03, bit), int(rng.integers(1, samples - 1))
        logged = jittered(samples, 0.01, bit + 100) + 2_000_000
        seconds, nanoseconds = divmod(int(stamps[wrong]), 10**9)
        flipped = (seconds, nanoseconds ^ 1 << bit) if bit < 30 else (seconds ^ 1 << (bit - 30), nanoseconds)
        stamps[wrong] = flipped[0] * 10**9 + flipped[1]
        write_stamped(tmp_path / "log.mcap", stamps, logged)
        with open_log(tmp_path / "log.mcap") as log:
            require_others_right(log, "/s.linear_acceleration.x", wrong, samples)


# In the gate each bit in one of the two kinds of messages.
@pytest.mark.parametrize(
    ("bits", "stamped"),
    [
        pytest.param(range(first, first + 9), stamped, marks=() if first % 2 == stamped else pytest.mark.nightly)
        for first in range(0, 62, 9)
        for stamped in (True, False)
    ],
)
def test_a_bit_flipped_in_a_log_time(tmp_path: Path, bits: Sequence[int], stamped: bool) -> None:
    """Which is the time of the samples, or stands beside the message's own stamps."""
    for bit in bits[: 62 - bits[0]]:
        rng = np.random.default_rng(bit)
        samples = int(rng.integers(20, 200))
        logged, wrong = jittered(samples, 0.03, bit), int(rng.integers(1, samples - 1))
        logged[wrong] ^= 1 << bit
        if stamped:
            write_stamped(tmp_path / "log.mcap", jittered(samples, 0.01, bit + 100), logged)
        else:
            write_numbers(tmp_path / "log.mcap", logged.tolist(), range(samples))
        with open_log(tmp_path / "log.mcap") as log:
            require_others_right(log, "/s.linear_acceleration.x" if stamped else "/s.data", wrong, samples)


@pytest.mark.parametrize("claim", CLAIMS)
@pytest.mark.parametrize("kind", ["csv", "npz"])
@pytest.mark.parametrize("jitter", [0.0, 0.05])
def test_a_wrong_time_of_a_row(tmp_path: Path, kind: str, claim: float, jitter: float) -> None:
    samples, wrong = 120, 20
    seconds = (jittered(samples, jitter, 1) - START_NS) * 1e-9
    seconds[wrong] = claim * PERIOD_NS * 1e-9
    path = tmp_path / f"table.{kind}"
    if kind == "csv":
        rows = [f"{time:.9f},{number}" for number, time in enumerate(seconds.tolist())]
        path.write_text("\n".join(["time [s],a [N]", *rows]), encoding="utf-8")
    else:
        np.savez(path, t=seconds, a=np.arange(float(samples)))
    require_others_right(
        open_any(path, **({} if kind == "csv" else {"time_unit": "s"})), "a", wrong, samples, start_ns=0
    )


def test_the_first_rows_of_a_table_stay_where_they_are(tmp_path: Path) -> None:
    """One wrong time, and 19 rows came one period late without a word."""
    seconds = np.arange(64) * 0.01
    seconds[20] = 0.00078
    rows = "\n".join(f"{time:.5f},{number}" for number, time in enumerate(seconds.tolist()))
    (tmp_path / "table.csv").write_text(f"time [s],a [N]\n{rows}\n", encoding="utf-8")
    log = open_any(tmp_path / "table.csv")
    expected = np.arange(64.0)
    expected[20] = np.nan
    np.testing.assert_array_equal(log.read(["a"]).values[0], expected)
    (note,) = [one for one in log.info().findings if "contradicts" in one and "row" in one]
    assert note.startswith("1 row left out")


@pytest.mark.parametrize("seconds", [0.1, 0.35, 10.0])
def test_blocks_leave_out_the_same_messages(tmp_path: Path, seconds: float) -> None:
    stamps = jittered(200, 0.03, 7)
    stamps[[30, 90, 150]] = START_NS + np.array([163.3, 12.6, 260.0]) // 1 * PERIOD_NS
    write_stamped(tmp_path / "log.mcap", stamps, jittered(200, 0.01, 8) + 2_000_000)
    with open_log(tmp_path / "log.mcap") as log:
        whole = log.read(["/s.linear_acceleration.x"]).values[0]
        blocks = log.blocks(["/s.linear_acceleration.x"], seconds=seconds)
        np.testing.assert_array_equal(np.concatenate([block.values[0] for block in blocks]), whole)
    expected = np.arange(200.0)
    expected[[30, 90, 150]] = np.nan
    np.testing.assert_array_equal(whole, expected)


@pytest.mark.parametrize(("start_s", "end_s"), [(0.2, 0.8), (0.0, 0.45), (0.45, None), (1.2, None)])
def test_a_window_is_that_part_of_the_whole(tmp_path: Path, start_s: float, end_s: float | None) -> None:
    """Wrong stamps lead into each window, and out of it."""
    stamps = jittered(200, 0.02, 3)
    stamps[30], stamps[100] = stamps[95] - 1_000_000, stamps[35] - 1_000_000
    stamps[60] = stamps[170] + 3_000_000
    write_stamped(tmp_path / "log.mcap", stamps, jittered(200, 0.0, 0) + 2_000_000)
    with open_log(tmp_path / "log.mcap") as log:
        part = log.read(["/s.linear_acceleration.x"], start_s=start_s, end_s=end_s)
    first = round((part.start_time_ns - START_NS) / PERIOD_NS)
    there = np.isfinite(part.values[0])
    np.testing.assert_array_equal(part.values[0][there], first + np.flatnonzero(there))
    assert np.count_nonzero(~there) <= 2


def test_messages_sent_twice_and_a_wrong_stamp(tmp_path: Path) -> None:
    """Repeats are counted as such, and the messages behind them are still the ones that are meant."""
    number = np.repeat(np.arange(150), np.where(np.isin(np.arange(150), [10, 90]), 2, 1))
    stamps = (START_NS + number * PERIOD_NS).astype(np.int64)
    stamps[number == 50] += 70 * PERIOD_NS + 3_000_000
    write_stored(tmp_path / "log.mcap", stamps, number.astype(float))
    with open_log(tmp_path / "log.mcap") as log:
        values, info = log.read(["/s.data"]).values[0], log.info()
    expected = np.arange(150.0)
    expected[50] = np.nan
    np.testing.assert_array_equal(values, expected)
    channel = info.channels[0]
    assert (channel.time_base.duplicates, channel.untimed, channel.samples) == (2, 1, 151)


def test_stored_out_of_order_is_no_wrong_log_time(tmp_path: Path) -> None:
    """A part that is stored behind the next one leaves a hole, too, and fits where its log times say."""
    number = np.concatenate([np.arange(40), np.arange(41, 90), [40], np.arange(90, 120)])
    stamps = stamps_of(number * 0.01)
    write_stored(tmp_path / "log.mcap", stamps, number.astype(float))
    with open_log(tmp_path / "log.mcap") as log:
        np.testing.assert_array_equal(log.read(["/s.data"]).values[0], np.arange(120.0))


def test_info_counts_what_is_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stamps = jittered(200, 0.0, 0)
    stamps[[30, 31, 90]] -= 12_345_678 * np.array([1, 2, 3])
    write_stamped(tmp_path / "log.mcap", stamps, jittered(200, 0.0, 0) + 2_000_000)
    assert main(["info", str(tmp_path / "log.mcap"), "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    (damage,) = told["damage"]
    assert damage["what"] == "/s: header.stamp contradicts the count of the messages around"
    assert damage["lost_messages"] == 3
    assert {(one["untimed"], one["samples"]) for one in told["channels"]} == {(3, 197)}
