"""Cases of all kinds: the model's file, the log's channels, and the truth of what they hide."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from chladni.signals.errors import EstimateError
from chladni.signals.linear_algebra import in_one_thread
from chladni_withheld.case import PARAMETER, HiddenEffect, Kind, LoggedChannel, WithheldCase
from chladni_withheld.networks.excitation import Hold
from chladni_withheld.networks.hiding import Hidden, RefusedError, logged, yardstick
from chladni_withheld.networks.linear_view import LinearView
from chladni_withheld.networks.network import GROUND, Drive, Matrix, Network
from chladni_withheld.networks.plots import PLOTS, Plot
from chladni_withheld.networks.scene import Rng

DEFAULT: Mapping[Kind, int] = MappingProxyType(
    {
        "effect": 35, "none": 10, "parameters": 5, "two": 8, "three": 4, "faint": 4, "leave_out": 6, "outside": 8,
        "topology": 8, "value": 7, "value_and_effect": 5,
    }
)  # fmt: skip
_MOST_DRAWS = 200
WRITES_HOLD = True
"""Whether half of the model files state how their inputs go on between samples."""
_UNITS = {
    False: {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m", "force": "N"},
    True: {"acceleration": "rad/s^2", "velocity": "rad/s", "displacement": "rad", "force": "N m"},
}


@in_one_thread()
def draw_case(seed: int, index: int, kind: Kind) -> WithheldCase:
    """Draw a case of a kind; see `chladni_withheld.case.DrawCase`.

    Draws that make no fair case are refused and drawn again, with the same word.

    Raises
    ------
    EstimateError
        When no draw makes a fair case, which is a defect.
    """
    refused: list[str] = []
    for rng in np.random.default_rng((seed, index)).spawn(_MOST_DRAWS):
        try:
            plot = PLOTS[kind](rng, seed, index)
        except RefusedError as refusal:
            refused.append(str(refusal))
            continue
        return _written(kind, rng, plot, refused)
    raise EstimateError(f"no {kind} case for seed {seed}, index {index}: {', '.join(sorted(set(refused)))}")


def _written(kind: Kind, rng: Rng, plot: Plot, refused: list[str]) -> WithheldCase:
    scene = plot.scene
    inputs = scene.recorded(plot.additions, filtered=True).inputs
    outputs = logged(scene, plot.additions, filtered=True)
    measure = yardstick(scene, outputs)
    change = _change(plot, outputs)
    ratio = None if change is None else measure.ratio(change)
    states_hold = rng.random() < 0.5
    wrong = tuple(_wrong_number(plot, name) for name in plot.wrong)
    return WithheldCase(
        kind=kind,
        model=model_text(plot.stated, scene.tolerances, scene.hold if states_hold else None),
        sample_rate_hz=scene.grid.rate_hz,
        channels=channels(scene.network, inputs, outputs),
        effects=tuple(map(_told, plot.hidden)) + (() if kind == "parameters" else wrong),
        off=_off(plot),
        parameters=scene.network.numbers(),
        noise=_noise(plot),
        coloured=scene.noise_colour != "white",
        change=None if ratio is None else ratio * measure.share,
        ratio=ratio,
        ratio_tuned=plot.hidden[0].ratio_tuned if len(plot.hidden) == 1 and not wrong else None,
        noise_share=measure.share,
        excitation=scene.words,
        starts_in_motion=scene.in_motion,
        modes_hz=tuple(plot.stated.modes_hz().tolist()),
        leave_out=plot.leave_out,
        further=_further(plot, refused),
    )


def _change(plot: Plot, outputs: Matrix) -> Matrix | None:
    """What all that is hidden changes of the log, wrong numbers included; None where nothing is."""
    if not plot.hidden and not plot.wrong:
        return None
    scene, numbers = plot.scene, plot.stated.numbers()
    change = outputs - logged(scene, (), filtered=True)
    if plot.wrong:
        wrong = scene.network.with_numbers({name: numbers[name] for name in plot.wrong})
        change += scene.view.log() - LinearView(network=wrong, grid=scene.grid, drives=scene.drives).log()
    return change


def _told(hidden: Hidden) -> HiddenEffect:
    draft = hidden.draft
    return HiddenEffect(
        effect=draft.word,
        site=draft.site,
        law=draft.law,
        parameters={name: float(value) for name, value in hidden.made.parameters.items()},
        source=draft.source,
        severity=hidden.ratio,
        severity_tuned=hidden.ratio_tuned,
    )


def _wrong_number(plot: Plot, name: str) -> HiddenEffect:
    numbers = {"nominal": plot.stated.numbers()[name], "true": plot.scene.network.numbers()[name]}
    return HiddenEffect(effect=PARAMETER, site=name, law="wrong number", parameters=numbers)


def _off(plot: Plot) -> dict[str, float]:
    stated, true = plot.stated.numbers(), plot.scene.network.numbers()
    return {name: (true[name] / stated[name] - 1) / plot.scene.tolerances[name] for name in plot.wrong}


def _noise(plot: Plot) -> dict[str, Any]:
    scene = plot.scene
    sensors = zip(scene.network.sensors, scene.noise_levels, scene.outputs_rms, strict=True)
    return {sensor.name: {"colour": scene.noise_colour, "rms": float(level * rms)} for sensor, level, rms in sensors}


def _further(plot: Plot, refused: list[str]) -> dict[str, Any]:
    scene = plot.scene
    nearest = {hidden.draft.site: hidden.nearest for hidden in plot.hidden if hidden.nearest}
    return {
        "hold": scene.hold,
        "common_filter": scene.recorder.anti_alias is not None,
        "steps_per_sample": scene.grid.over,
        "nearest_other": {site: {"name": name, "left": round(left, 2)} for site, (name, left) in nearest.items()},
        "refused": refused,
        **plot.further,
    }


def model_text(network: Network, tolerances: Mapping[str, float], hold: Hold | None) -> str:
    """Text of the model file of a nominal network."""
    tables = ['format = "chladni.model/1"\nname = "case"\nkind = "structure"\n']
    for body, mass in zip(network.bodies, network.masses, strict=True):
        tables.append(_table("body", {"name": body, network.mass_word: mass}))
    for joint in network.joints:
        between = [_end(network, joint.first), _end(network, joint.second)]
        numbers = {"stiffness": joint.stiffness, "damping": joint.damping}
        tables.append(_table("joint", {"name": joint.name, "between": between, **numbers}))
    tables += [_table("input", _input_keys(network, drive, hold)) for drive in network.drives]
    for sensor in network.sensors:
        at = (
            {"at": network.bodies[sensor.at]} if sensor.where == "body" else {"joint": network.joints[sensor.at].name}
        )
        keys = {"name": sensor.name, "measures": sensor.measures, **at, "channel": channel_name(sensor.name)}
        tables.append(_table("output", keys))
    return "\n".join([*tables, _tolerance_table(tolerances)])


def _input_keys(network: Network, drive: Drive, hold: Hold | None) -> dict[str, object]:
    at: dict[str, object] = {"kind": "base_acceleration"}
    if drive.where == "body":
        at = {"at": network.bodies[drive.at]}
    elif drive.where == "joint":
        at = {"joint": network.joints[drive.at].name}
    stated = {"hold": hold} if hold and WRITES_HOLD else {}
    return {"name": drive.name, **at, "channel": channel_name(drive.name), **stated}


def _end(network: Network, end: int) -> str:
    return "ground" if end == GROUND else network.bodies[end]


def _table(kind: str, keys: Mapping[str, object]) -> str:
    return "\n".join([f"[[{kind}]]", *(f"{key} = {_toml(value)}" for key, value in keys.items()), ""])


def _tolerance_table(tolerances: Mapping[str, float]) -> str:
    """Tolerances, those of most numbers as the default."""
    sizes = list(tolerances.values())
    default = max(set(sizes), key=lambda size: (sizes.count(size), size))
    others = {name: size for name, size in tolerances.items() if size != default}
    lines = [f"default = {default!r}", *(f'"{name}" = {size!r}' for name, size in others.items())]
    return "\n".join(["[tolerance]", *lines, ""])


def _toml(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_toml(item) for item in value)}]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def channel_name(port: str) -> str:
    """Name of a port's channel in the log."""
    return f"/{port}.value"


def channels(network: Network, inputs: Matrix, outputs: Matrix) -> tuple[LoggedChannel, ...]:
    """Channels of the log: the inputs first."""
    units = _UNITS[network.rotary]
    driven = [
        LoggedChannel(
            name=channel_name(drive.name), unit=units["acceleration" if drive.where == "ground" else "force"],
            samples=inputs[row], drives=True,
        )
        for row, drive in enumerate(network.drives)
    ]  # fmt: skip
    measured = [
        LoggedChannel(name=channel_name(sensor.name), unit=units[sensor.measures], samples=outputs[row])
        for row, sensor in enumerate(network.sensors)
    ]
    return (*driven, *measured)
