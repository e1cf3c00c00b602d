"""``chladni info``: whether the log is sound."""

from typing import TYPE_CHECKING, Any

from chladni.cli import options
from chladni.cli.channel_rows import grouped_rows
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import NOTHING, count, number, unit
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.io.loss import Unread


def info(
    log: options.Log,
    *,
    setup: options.Setup = None,
    stamp: options.Stamp = "auto",
    json: options.Json = None,
) -> None:
    """Channels, rates, duration, time base and damage of a log."""
    from chladni.io.log import open_log

    require_places(reads=[log, setup], writes={"--json": json})
    out = Output(json)
    with open_log(log, setup=setup, stamp=stamp) as opened, out.progress(log.name):
        found = opened.info()
    content = found.to_json()
    out.table(
        f"{log.name}: {number(found.duration_s)} s",
        ["channel", "unit", "rate [Hz]", "samples", "jitter [s]", "stamp", "trouble"],
        grouped_rows([*map(_row, content["channels"]), *(_unread_row(one) for one in found.unread if not one.field)]),
    )
    out.lines(found.findings)
    out.json(content)


def _row(channel: dict[str, Any]) -> list[str]:
    # One column for what is mostly nothing: three of zeros took the room that names need.
    trouble = {"gaps": len(channel["gaps"]), "duplicates": channel["duplicates"], "clipped": channel["clipped"]}
    return [
        channel["name"],
        unit(channel["unit"]),
        number(channel["rate_hz"], digits=9),
        count(channel["samples"]),
        number(channel["jitter_s"], digits=2),
        channel["stamp"],
        ", ".join(f"{count(times)} {what}" for what, times in trouble.items() if times) or NOTHING,
    ]


def _unread_row(topic: "Unread") -> list[str]:
    """Row of a topic without channels; the reason is told below the table, or there is none."""
    messages = "" if topic.messages is None else f"{counted(topic.messages, 'message')}, "
    return [topic.name, *[NOTHING] * 5, f"{messages}{'no signal' if topic.complete else 'not read'}"]
