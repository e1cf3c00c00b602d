"""Where a channel's unit comes from."""

import json
from collections.abc import Mapping
from typing import Any

import pytest

from chladni.io.channel_source import channel_of, comment_units, measured_fields
from chladni.io.topic import Topic

# The layout of sensor_msgs/NavSatFix: each comment stands above the field it speaks of.
ABOVE = """# Latitude [degrees].
float64 latitude

# Longitude [degrees].
float64 longitude

# Altitude [m].
float64 altitude

# Position covariance [m^2]
float64[9] position_covariance
"""


def test_a_comment_on_the_next_line_is_not_the_field_s() -> None:
    assert comment_units(ABOVE) == {}


def test_a_comment_behind_a_field_may_follow_a_constant_and_end_in_a_carriage_return() -> None:
    assert comment_units("float64 x  # along the beam [mm]\r\nfloat64 G=9.8 # [m/s^2]\r\n") == {
        "x": "mm",
        "G": "m/s^2",
    }


def topic(metadata: Mapping[str, str]) -> Topic:
    return Topic(name="/a", schema_name="", encoding="json", metadata=metadata, decoders={}, schema_text="")


@pytest.mark.parametrize("said", ["1" * 5000, "[" * 50_000, "[1]", "{", '"x"'])
def test_metadata_that_means_nothing_is_passed_over(said: str) -> None:
    named: dict[str, Any] = {"name": "/a.x", "field": "x", "leaf": "x", "unit": None}
    assert measured_fields({"chladni.fields": said}) is None
    channel, factor, _ = channel_of(topic({"chladni.direction.x": said}), **named)
    assert (channel.direction, channel.overload, factor) == (None, None, 1.0)


@pytest.mark.parametrize(
    ("said", "overload"), [("5e1", 50.0), ("1_0", None), ("٣", None), ("nan", None), ("-1", None)]
)
def test_an_overload_in_the_metadata_is_a_positive_number(said: str, overload: float | None) -> None:
    metadata = {"chladni.overload.x": said, "chladni.fields": json.dumps(["x"])}
    channel, _, _ = channel_of(topic(metadata), name="/a.x", field="x", leaf="x", unit=None)
    assert channel.overload == overload
