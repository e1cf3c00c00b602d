"""``chladni excite``: a motion to be run on a robot, that tells its inertias and friction apart."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.cli import options
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.settings import named_numbers
from chladni.cli.words import number

if TYPE_CHECKING:
    from chladni.robots.trajectory import JointUse, Trajectory

Robot = Annotated[Path, typer.Argument(metavar="ROBOT", help="An MJCF, a URDF, or a robot file.", show_default=False)]
Target = Annotated[
    Path, typer.Option("--out", metavar="FILE.csv", help="The trajectory to write.", show_default=False)
]
Length = Annotated[float, typer.Option(metavar="S", help="Length, whole periods.")]
Rate = Annotated[float, typer.Option(metavar="HZ", help="Samples a second.")]
Harmonics = Annotated[int, typer.Option(metavar="N", help="Of the base frequency, 2 to 20.")]
Base = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="One over the period; about 0.1 Hz if not given.", show_default=False),
]
Joints = Annotated[
    str | None,
    typer.Option(
        metavar="A,B", help="Only these joints, or patterns like wrist_*; the others rest.", show_default=False
    ),
]
Pose = Annotated[
    list[str] | None,
    typer.Option(
        metavar="JOINT=X", help="Where it starts, rad (m); its range's middle if not given.", show_default=False
    ),
]
Travel = Annotated[float, typer.Option(metavar="SHARE", help="Of the way from the start to the stops.")]
Speed = Annotated[float, typer.Option(metavar="SHARE", help="Of the limits of velocity.")]
Torque = Annotated[float, typer.Option(metavar="SHARE", help="Of the limits of effort.")]
Seed = Annotated[int, typer.Option(metavar="N", min=0, help="Of what the search begins with.")]


def excite(
    robot: Robot,
    *,
    out: Target,
    length: Length = 10.0,
    rate: Rate = 250.0,
    harmonics: Harmonics = 5,
    base_frequency: Base = None,
    joints: Joints = None,
    pose: Pose = None,
    travel: Travel = 0.9,
    speed: Speed = 0.5,
    torque: Torque = 0.8,
    seed: Seed = 0,
    json: options.Json = None,
) -> None:
    """A motion inside a robot's limits that tells its inertias, friction and armatures apart, to be run on it."""
    require_places(reads=[robot], writes={"--out": out, "--json": json})
    to = Output(json)
    from chladni.robots.excite import excite as exciting
    from chladni.robots.loading import load_robot
    from chladni.robots.motion_limits import UNIT
    from chladni.robots.trajectory import require_csv, write_trajectory

    require_csv(out)
    described = load_robot(robot, meshes=False)
    start = named_numbers(pose or (), "--pose", {one.name: UNIT[one.kind] for one in described.joints})
    with to.progress(robot.name) as progress:
        made = exciting(
            described,
            duration_s=length,
            sample_rate_hz=rate,
            harmonics=harmonics,
            base_frequency_hz=base_frequency,
            joints=[one.strip() for one in joints.split(",")] if joints is not None else (),
            pose=start,
            travel=travel,
            speed=speed,
            torque=torque,
            seed=seed,
            progress=progress,
        )
    write_trajectory(made, out)
    _print(to, made)
    to.line(f"wrote {out}")
    to.json(made.to_json)


def _print(to: Output, made: "Trajectory") -> None:
    periods = round(made.duration_s * made.base_frequency_hz)
    to.line(
        f"{made.robot}: {number(made.duration_s)} s, {periods} x {number(1.0 / made.base_frequency_hz)} s, "
        f"{made.harmonics} harmonics up to {number(made.harmonics * made.base_frequency_hz)} Hz"
    )
    to.table(
        "What it uses of the limits",
        ["joint", "from", "to", "range", "top speed", "of", "top torque", "of"],
        [_row(one) for one in made.use],
    )
    to.line(
        f"Condition number of {made.parameters} base parameters: {made.condition:.3g} "
        f"(random motions: {made.random_condition:.3g})"
    )
    to.lines(made.remarks)


def _row(one: "JointUse") -> list[str]:
    effort = "N m" if one.unit == "rad" else "N"
    stops = "-" if one.range is None else f"{one.range[0]:.3g} .. {one.range[1]:.3g}"
    return [
        one.joint,
        f"{one.low:.3g} {one.unit}",
        f"{one.high:.3g} {one.unit}",
        stops,
        f"{one.speed:.3g} {one.unit}/s",
        number(one.speed_limit),
        f"{one.torque:.3g} {effort}",
        number(one.torque_limit),
    ]
