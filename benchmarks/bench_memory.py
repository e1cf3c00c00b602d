"""Average an hour of 12 channels at 25.6 kHz from a log on disk: resident memory and times real time."""

import resource
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

CHANNELS, RATE_HZ, HOUR_S = 12, 25_600, 3600
DEFINITION = b"""std_msgs/Header header
float64 sample_rate
string[] channel_names
float32[] samples
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def block_prefix(seconds: int) -> bytes:
    """CDR of everything before the samples of a one-second block."""
    body = struct.pack("<iII4sd", seconds, 0, 1, b"\0\0\0\0", float(RATE_HZ)) + struct.pack("<I", CHANNELS)
    for number in range(CHANNELS):
        name = f"ch{number:02d}".encode() + b"\0"
        body += b"\0" * (-len(body) % 4) + struct.pack("<I", len(name)) + name
    return b"\0\1\0\0" + body + b"\0" * (-len(body) % 4) + struct.pack("<I", CHANNELS * RATE_HZ)


def write_hour(path: Path, seconds: int) -> None:
    """Write one-second blocks of noise, zstd as any recorder would."""
    rng = np.random.default_rng(3)
    noise = [rng.standard_normal(CHANNELS * RATE_HZ).astype("<f4").tobytes() for _ in range(4)]
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=4 << 20)
        writer.start(profile="ros2")
        schema = writer.register_schema("daq_msgs/msg/SampleBlock", "ros2msg", DEFINITION)
        channel = writer.register_channel("/daq", "cdr", schema)
        for second in range(seconds):
            stamp = 1_700_000_000 + second
            writer.add_message(channel, stamp * 10**9, block_prefix(stamp) + noise[second % 4], stamp * 10**9)
        writer.finish()


def average(path: Path) -> None:
    """Do the work in this process and print seconds, megabytes and averages."""
    import chladni

    begun = time.perf_counter()
    with chladni.open_log(path) as log:
        density = chladni.psd(log, resolution_hz=6.25)
    elapsed = time.perf_counter() - begun
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(elapsed, megabytes, density.provenance.averages, len(density.channels))


def main() -> None:
    """Write the log, average it in a fresh process, print the table."""
    if sys.argv[1:2] == ["--average"]:
        average(Path(sys.argv[2]))
        return
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else HOUR_S
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as folder:
        path = Path(folder) / "hour.mcap"
        write_hour(path, seconds)
        size = path.stat().st_size / 1e9
        command = [sys.executable, __file__, "--average", str(path)]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    elapsed, megabytes, averages, channels = (float(word) for word in output.split())
    print("| log on disk | channels | averages | resident memory | times real time |")
    print("| --- | ---: | ---: | ---: | ---: |")
    log = f"{seconds} s, {size:.1f} GB"
    print(f"| {log} | {channels:.0f} | {averages:.0f} | {megabytes:.0f} MB | {seconds / elapsed:.0f} |")


if __name__ == "__main__":
    main()
