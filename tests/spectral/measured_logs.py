"""Measured logs as series in SI units."""

from pathlib import Path

from chladni.io.log import open_log
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries


def aircraft(folder: Path, level: int) -> TimeSeries:
    """Force of the shaker and acceleration of the payload."""
    paths = ["/shaker.wrench.force.z", "/payload_rail.accel.linear.z"]
    series = open_log(folder / f"f16_level{level}.mcap").read(paths)
    channels = (Channel(name="/shaker", unit="N", role="reference"), Channel(name="/payload_rail", unit="m/s^2"))
    return series.with_channels(channels)


def hammer(folder: Path) -> TimeSeries:
    """Force and response of five hits, which the log gives without units."""
    series = open_log(folder / "hammer.mcap").read(["/daq.hammer", "/daq.response"])
    return series.with_channels((Channel(name="/daq.hammer", unit="N"), Channel(name="/daq.response", unit="m/s^2")))
