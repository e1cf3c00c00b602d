"""``chladni info``: whether the log is sound."""

from typing import Any

from chladni.cli import options
from chladni.cli.channel_rows import grouped_rows
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import NOTHING, count, number, unit


def info(
    log: options.Log,
    *,
    setup: options.Setup = None,
    stamp: options.Stamp = "auto",
    rate: options.Rate = None,
    json: options.Json = None,
) -> None:
    """Channels, rates, duration, time base and damage of a log."""
    from chladni.io.log import open_log

    require_places(reads=[log, setup], writes={"--json": json})
    out = Output(json)
    with open_log(log, setup=setup, stamp=stamp, sample_rate_hz=rate) as opened, out.progress(log.name):
        found = opened.info()
    content = found.to_json()
    out.table(
        f"{log.name}: {number(found.duration_s)} s",
        ["channel", "unit", "rate [Hz]", "samples", "jitter [s]", "stamp", "trouble"],
        grouped_rows([_row(channel) for channel in content["channels"]]),
    )
    out.lines(found.findings)
    out.json(content)


def _row(channel: dict[str, Any]) -> list[str]:
    # One column for what is mostly nothing: three of zeros took the room that names need.
    trouble = {
        "breaks": len(channel["breaks"]),
        "gaps": len(channel["gaps"]),
        "duplicates": channel["duplicates"],
        "clipped": channel["clipped"],
    }
    return [
        channel["name"],
        unit(channel["unit"]),
        number(channel["rate_hz"], digits=9),
        count(channel["samples"]),
        number(channel["jitter_s"], digits=2),
        channel["stamp"],
        ", ".join(f"{count(times)} {what}" for what, times in trouble.items() if times) or NOTHING,
    ]
