"""Speed of MCAP to arrays, against the peers, the same work on both sides."""

import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from imu_log import write_imu_log
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from rerun.chunk import McapReader

import chladni

MESSAGES = 400_000
SLOW_MESSAGES = 40_000  # the slow peers read a shorter log of the same kind: their speed doesn't depend on length
JITTER_NS = 50_000
FIELDS = [f"{group}.{axis}" for group in ("linear_acceleration", "angular_velocity") for axis in "xyz"]


def best_times_s(works: dict[str, Callable[[], object]], repeats: int = 7) -> dict[str, float]:
    """Shortest of a few runs of each: what the work costs when nothing else disturbs.

    They take turns, so that whatever else the machine does meets all of them.
    """
    times = dict.fromkeys(works, float("inf"))
    for _ in range(repeats):
        for name, work in works.items():
            begun = time.perf_counter()
            work()
            times[name] = min(times[name], time.perf_counter() - begun)
    return times


def read_ours(path: Path, channels: list[str]) -> np.ndarray:
    """Read arrays on the fitted time grid, checksums verified."""
    with chladni.open_log(path) as log:
        return np.asarray(log.read(channels).values)


def read_mcap_ros2(path: Path) -> np.ndarray:
    """Decode with the mcap package and its ROS 2 decoder, a Python object a message."""
    rows = []
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for decoded in reader.iter_decoded_messages():
            message = decoded.decoded_message
            linear, angular = message.linear_acceleration, message.angular_velocity
            stamp = message.header.stamp
            rows.append(
                (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z, stamp.sec * 10**9 + stamp.nanosec)
            )
    return np.array(rows)


def read_rerun(path: Path) -> int:
    """Let rerun's Rust reader turn the log into Arrow columns."""
    rows = 0
    for chunk in McapReader(path, decoders=["ros2msg"]).stream():
        rows += chunk.num_rows
    return rows


def write_json_log(path: Path, messages: int) -> None:
    """Write two topics of stamped numbers, LZ4."""
    rng = np.random.default_rng(2)
    values = rng.standard_normal(messages)
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.LZ4)
        writer.start()
        schema = writer.register_schema("Sample", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/input", "json", schema)
        for index, value in enumerate(values.tolist()):
            stamp = {"sec": 1_700_000_000 + index // 1000, "nsec": index % 1000 * 1_000_000}
            time_ns = stamp["sec"] * 10**9 + stamp["nsec"]
            writer.add_message(channel, time_ns, json.dumps({"timestamp": stamp, "value": value}).encode(), time_ns)
        writer.finish()


def read_json_loads(path: Path) -> np.ndarray:
    """Decode JSON with json.loads, a message at a time, from the mcap package's reader."""
    rows = []
    with path.open("rb") as stream:
        for _, _, message in make_reader(stream, validate_crcs=True).iter_messages():
            content = json.loads(message.data)
            stamp = content["timestamp"]
            rows.append((content["value"], stamp["sec"] * 10**9 + stamp["nsec"]))
    return np.array(rows)


def decode_json_loads(messages: list[bytes]) -> list[tuple[float, int]]:
    """Run json.loads on messages that are in memory already: the narrowest comparison."""
    rows = []
    for data in messages:
        content = json.loads(data)
        stamp = content["timestamp"]
        rows.append((content["value"], stamp["sec"] * 10**9 + stamp["nsec"]))
    return rows


def bench_imu(folder: Path) -> None:
    """Compare on Imu messages."""
    write_imu_log(folder / "imu.mcap", MESSAGES)
    write_imu_log(folder / "short.mcap", SLOW_MESSAGES)
    channels = [f"/imu.{field}" for field in FIELDS]
    np.testing.assert_array_equal(
        read_ours(folder / "short.mcap", channels), read_mcap_ros2(folder / "short.mcap")[:, :6].T
    )
    write_imu_log(folder / "jitter.mcap", MESSAGES, jitter_ns=JITTER_NS)
    ours, jittered = "chladni, six channels on the fitted time grid", "the same, stamps that scatter by 5 %"
    mcap, rerun = "`mcap` + `mcap-ros2-support`", "rerun `McapReader`"
    times = best_times_s(
        {
            ours: lambda: read_ours(folder / "imu.mcap", channels),
            jittered: lambda: read_ours(folder / "jitter.mcap", channels),
            rerun: lambda: read_rerun(folder / "imu.mcap"),
        }
    ) | best_times_s({mcap: lambda: read_mcap_ros2(folder / "short.mcap")}, repeats=3)
    speeds = {name: (SLOW_MESSAGES if name == mcap else MESSAGES) / seconds for name, seconds in times.items()}
    print_table(f"{MESSAGES} Imu messages, zstd, CRC checked", speeds, ours=(ours, jittered))


def print_table(what: str, speeds: dict[str, float], *, ours: tuple[str, ...]) -> None:
    """Print speeds, and those of the peers in relation to the first of ours."""
    print(f"| {what} | messages/s | chladni is faster by |")
    print("| --- | ---: | ---: |")
    for name, speed in speeds.items():
        print(f"| {name} | {speed:,.0f} | {'' if name in ours else f'{speeds[ours[0]] / speed:.1f}'} |")


def bench_json(folder: Path) -> None:
    """Compare on JSON messages."""
    path = folder / "json.mcap"
    write_json_log(path, SLOW_MESSAGES * 5)
    messages = SLOW_MESSAGES * 5
    np.testing.assert_array_equal(read_ours(path, ["/input.value"])[0], read_json_loads(path)[:, 0])
    with path.open("rb") as stream:
        encoded = [message.data for _, _, message in make_reader(stream).iter_messages()]
    ours = "chladni, from file to array"
    times = best_times_s(
        {
            ours: lambda: read_ours(path, ["/input.value"]),
            "`json.loads` a message, bytes already in memory": lambda: decode_json_loads(encoded),
        }
    ) | best_times_s({"`mcap` reader and `json.loads` a message": lambda: read_json_loads(path)}, repeats=3)
    speeds = {name: messages / seconds for name, seconds in times.items()}
    print()
    print_table(f"{messages} JSON messages, LZ4", speeds, ours=(ours,))


def main() -> None:
    """Print both tables."""
    with tempfile.TemporaryDirectory() as folder:
        bench_imu(Path(folder))
        bench_json(Path(folder))


if __name__ == "__main__":
    main()
