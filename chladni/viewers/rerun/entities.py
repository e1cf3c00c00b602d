"""Entity paths: folders that we name, and one part for each channel whatever characters its name holds."""

import re

import rerun as rr

from chladni.signals.channel import Channel
from chladni.signals.visible import visible


def folder(*parts: str) -> str:
    """Join parts to a path of plain words, safe in the query expressions of a blueprint.

    Examples
    --------
    >>> folder("waveforms", "Acceleration 2/3")
    '/waveforms/acceleration_2_3'
    """
    # Anything else than these could be an operator in a query expression, or need escaping.
    return "/" + "/".join(re.sub(r"[^a-z0-9]+", "_", part.lower()).strip("_") for part in parts)


def channel_entity(parent: str, channel: Channel) -> str:
    r"""Give the path of a channel under `parent`: its whole name as one escaped part, so no two names can meet.

    Examples
    --------
    >>> channel_entity("/waveforms/force", Channel(name="/hammer.force.x"))
    '/waveforms/force/\\/hammer.force.x'
    """
    return f"{parent}/{rr.escape_entity_path_part(visible(channel.name))}"
