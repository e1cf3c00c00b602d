"""What the log writer says about channels in MCAP channel metadata, beside what the message schema says.

MCAP metadata is a map of strings for each topic. A *field* below is the part of a channel's name after its topic:
``linear_acceleration.x``, ``position[0]``, or a column name of a batch message.

================================  =========================================================================
``chladni.format``                ``chladni.log/1``
``chladni.sample_rate_hz``        rate of the topic's samples, in full precision
``chladni.fields``                JSON list of the fields that were measured; all others of the message are padding
``chladni.unit.<field>``          unit of the samples, ``1`` when unknown
``chladni.point.<field>``         measurement point, absent when unknown
``chladni.direction.<field>``     JSON list of three numbers, absent when unknown
``chladni.role.<field>``          ``reference`` or ``response``
``chladni.overload.<field>``      largest magnitude the sensor can tell, in the unit; absent when unknown
================================  =========================================================================
"""

import json
from collections.abc import Mapping

from chladni.signals.channel import Channel

LOG_FORMAT = "chladni.log/1"


def channel_metadata(channels: Mapping[str, Channel], *, sample_rate_hz: float) -> dict[str, str]:
    """Give the MCAP metadata of one topic.

    Parameters
    ----------
    channels
        The measured channels by field.

    Examples
    --------
    >>> channel_metadata({"value": Channel(name="/a.value", unit="N")}, sample_rate_hz=10.0)["chladni.unit.value"]
    'N'
    """
    metadata = {
        "chladni.format": LOG_FORMAT,
        "chladni.sample_rate_hz": repr(float(sample_rate_hz)),
        "chladni.fields": json.dumps(list(channels)),
    }
    for field, channel in channels.items():
        metadata.update({f"chladni.{key}.{field}": text for key, text in _attributes(channel).items()})
    return metadata


def _attributes(channel: Channel) -> dict[str, str]:
    attributes = {"unit": channel.unit, "role": channel.role}
    if channel.point is not None:
        attributes["point"] = channel.point
    if channel.direction is not None:
        attributes["direction"] = json.dumps(list(channel.direction))
    if channel.overload is not None:
        attributes["overload"] = repr(float(channel.overload))
    return attributes
