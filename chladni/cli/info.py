"""``chladni info``: whether the log is sound."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chladni.cli import options
from chladni.cli.channel_rows import grouped_rows
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import NOTHING, count, number, unit
from chladni.signals.errors import SetupError
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.io.log import Log
    from chladni.io.loss import Unread
    from chladni.robots.joint_info import JointInfo, RobotLogInfo


Robot = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="MJCF, URDF or robot file: tell what the log has of it.", show_default=False),
]
State = Annotated[
    str | None,
    typer.Option(metavar="TOPIC", help="With --robot, where its joints were measured.", show_default=False),
]
Command = Annotated[
    str | None,
    typer.Option(metavar="TOPIC", help="With --robot, where its joints were commanded.", show_default=False),
]


@opens_files
def info(
    log: options.Log,
    *,
    robot: Robot = None,
    state: State = None,
    command: Command = None,
    opener: Opener,
    json: options.Json = None,
) -> None:
    """Channels, rates, duration, time base and damage of a log; with --robot what it tells of a robot's joints."""
    if robot is None and (state is not None or command is not None):
        raise SetupError("--state and --command name topics of a robot's joints; give the robot, too: --robot FILE")
    require_places(reads=[log, robot, opener.setup], writes={"--json": json})
    out = Output(json)
    with opener(log) as opened, out.progress(log.name):
        matched = None if robot is None else _matched(robot, opened, state, command)
        found = opened.info()
    content = found.to_json() | ({} if matched is None else {"robot": matched.to_json()})
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
    if matched is not None:
        _print_robot(out, matched)
    out.json(lambda: content)


def _matched(robot: Path, log: "Log", state: str | None, command: str | None) -> "RobotLogInfo":
    from chladni.robots.joint_info import robot_info
    from chladni.robots.loading import load_robot

    return robot_info(load_robot(robot, meshes=False), log, state=state, command=command)


def _print_robot(out: Output, found: "RobotLogInfo") -> None:
    log = found.log
    commands = "no commands"
    if log.command_topic is not None:
        rate = "at no fixed rate" if log.command_rate_hz is None else f"{number(log.command_rate_hz, digits=6)} Hz"
        commands = f"{log.command_kind} commands {log.command_topic} {rate}"
    out.line()
    out.table(
        f"{found.robot.name}: {len(log.joints)} of {counted(len(found.joints), 'joint')}; states {log.state_topic} "
        f"{number(log.sample_rate_hz, digits=6)} Hz; {commands}",
        ["joint", "unit", "motion", "resolution", "command", "effort", "gains", "trouble"],
        [_joint_row(one) for one in found.joints],
    )
    out.lines(found.findings)


def _joint_row(one: "JointInfo") -> list[str]:
    return [
        one.joint.name,
        one.unit,
        NOTHING if one.motion is None else number(one.motion),
        NOTHING if one.resolution is None else number(one.resolution),
        "yes" if one.commanded else NOTHING,
        "yes" if one.effort else NOTHING,
        one.gains or NOTHING,
        "not in the log" if not one.matched else "hardly moves" if one.still else NOTHING,
    ]


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
