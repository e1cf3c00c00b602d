"""``chladni info``: whether the log is sound."""

from typing import TYPE_CHECKING, Any

from chladni.cli import options
from chladni.cli.channel_rows import grouped_rows
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import NOTHING, count, number, unit
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.io.loss import Unread


@opens_files
def info(
    log: options.Log,
    *,
    opener: Opener,
    json: options.Json = None,
) -> None:
    """Channels, rates, duration, time base and damage of a log."""
    require_places(reads=[log, opener.setup], writes={"--json": json})
    out = Output(json)
    with opener(log) as opened, out.progress(log.name):
        found = opened.info()
    content = found.to_json()
    unread = [one for one in found.unread if not one.field]
    functions = content.get("functions", [])
    if content["channels"] or unread or not functions:
        out.table(
            f"{log.name}: {number(found.duration_s)} s",
            ["channel", "unit", "rate [Hz]", "samples", "jitter [s]", "stamp", "trouble"],
            grouped_rows([*map(_row, content["channels"]), *(_unread_row(one) for one in unread)]),
        )
    if functions:
        out.table(
            f"{log.name}: {counted(len(functions), 'frequency response')}",
            ["response", "reference", "unit", "lines", "from [Hz]", "to [Hz]"],
            grouped_rows([_function_row(function) for function in functions]),
        )
    out.lines(found.findings)
    out.json(content)


def _function_row(function: dict[str, Any]) -> list[str]:
    return [
        function["response"],
        function["reference"],
        unit(function["unit"]),
        count(function["lines"]),
        number(function["low_hz"], digits=6),
        number(function["high_hz"], digits=6),
    ]


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


def _unread_row(topic: "Unread") -> list[str]:
    """Row of a topic without channels; the reason is told below the table, or there is none."""
    messages = "" if topic.messages is None else f"{counted(topic.messages, 'message')}, "
    return [topic.name, *[NOTHING] * 5, f"{messages}{'no signal' if topic.complete else 'not read'}"]
