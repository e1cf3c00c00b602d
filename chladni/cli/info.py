"""``chladni info``: whether the log is sound."""

from chladni.cli import options
from chladni.cli.output import Output


def info(
    log: options.Log,
    *,
    setup: options.Setup = None,
    stamp: options.Stamp = "auto",
    json: options.Json = None,
) -> None:
    """Channels, rates, duration, time base and damage of a log."""
    from chladni.cli.words import count, number
    from chladni.io.log import open_log

    out = Output(json)
    with open_log(log, setup=setup, stamp=stamp) as opened, out.progress(log.name):
        found = opened.info()
    content = found.to_json()
    out.table(
        f"{log.name}: {number(found.duration_s)} s",
        ["channel", "unit", "rate [Hz]", "samples", "jitter [s]", "gaps", "duplicates", "clipped", "stamp"],
        [
            [
                channel["name"],
                channel["unit"],
                number(channel["rate_hz"], digits=9),
                count(channel["samples"]),
                number(channel["jitter_s"], digits=2),
                count(len(channel["gaps"])),
                count(channel["duplicates"]),
                count(channel["clipped"]),
                channel["stamp"],
            ]
            for channel in content["channels"]
        ],
    )
    out.lines(found.findings)
    out.json(content)
