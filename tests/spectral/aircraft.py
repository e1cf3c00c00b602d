"""The aircraft's vibration tests, read once for all tests."""

from functools import cache
from pathlib import Path

from chladni.io.log import open_log
from chladni.signals.time_series import TimeSeries

SHAKER = "/shaker.wrench.force.z"
PAYLOAD = "/payload_rail.accel.linear.z"
ACCELEROMETERS = ("/excitation.accel.linear.z", "/wing_rail.accel.linear.z", PAYLOAD)


@cache
def aircraft(folder: Path, level: int) -> TimeSeries:
    """Force and the three accelerations at one level."""
    return open_log(folder / f"f16_level{level}.mcap").read([SHAKER, *ACCELEROMETERS])
