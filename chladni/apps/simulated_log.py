"""A log of a simulated model, with its truth beside it and inside it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import floor, inf, log10, pi
from pathlib import Path
from typing import Any

import numpy as np

from chladni.apps.excitation_words import Run, excitation
from chladni.apps.measured_charts import scores
from chladni.io.atomic import atomic_write, require_place
from chladni.io.mcap.topic_names import message_places
from chladni.io.mcap.writer import WrittenLog, write_mcap
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, Model
from chladni.models.core.reading import Quantity
from chladni.models.core.simulation import Simulation
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.integrator.simulate import simulate
from chladni.signals.errors import SetupError
from chladni.signals.number_range import LARGEST, rms
from chladni.signals.time_series import TimeSeries
from chladni.signals.visible import visible_json

TRUTH_FORMAT = "chladni.truth/1"
METADATA_NAME = "chladni.truth"
START_TIME_NS = 1_760_000_000_000_000_000

# The rate is at least so many times the highest natural frequency, the run so many times the longest decay time.
RATE_OVER_HIGHEST = 20.0
RUN_OVER_DECAY = 30.0
SHORTEST_RUN_S, MOST_DEFAULT_SAMPLES = 10.0, 50_000
SLOWEST_RATE_HZ, FASTEST_RATE_HZ = 10.0, 1e5
# Of a model without states, such as a damper whose motion is prescribed.
RATE_WITHOUT_POLES_HZ = 1000.0
# Stamps of a log count nanoseconds: at this rate rounding moves a sample by a twentieth of its interval at most.
FASTEST_LOGGED_HZ = 1e8


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What drives a simulation.

    Attributes
    ----------
    word
        Kind of excitation, see `excitation`.
    level
        Its size, in the input's unit.
    input_name
        Which input; the first if None.
    band_hz
        Of noise, multisine and sweep.
    seed
        Start of the random numbers, those of the sensors' noise included.
    noise
        Standard deviation of each output's sensor noise over the output's own RMS.
    """

    word: str = "random"
    level: float = 1.0
    input_name: str | None = None
    band_hz: tuple[float, float] | None = None
    seed: int = 0
    noise: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("level", self.level), ("noise", self.noise)):
            if not abs(value) <= LARGEST:
                raise SetupError(f"{name} {value:g} must be finite, and {LARGEST:.2g} at most")
        if self.noise < 0:
            raise SetupError(f"noise {self.noise} must not be negative; it's a share of each output's RMS")
        if self.seed < 0:
            raise SetupError(f"seed {self.seed} must not be negative")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatedLog:
    """What was simulated, and what is true of it.

    Attributes
    ----------
    simulation
        Clean signals.
    recorded
        Inputs and outputs as a log would hold them, sensor noise added.
    truth
        Everything that was put in, ready for JSON.
    agreement
        NRMSE of each output that the driving recording holds too.
    """

    simulation: Simulation
    recorded: TimeSeries
    truth: Mapping[str, Any]
    agreement: tuple[Quantity, ...] = ()


def simulate_log(model: Model, drive: Drive, *, seconds: float | None = None, rate_hz: float | None = None,
                 recording: TimeSeries | None = None) -> SimulatedLog:  # fmt: skip
    """Simulate a model as a measurement.

    Parameters
    ----------
    model
        Any model.
    drive
        Excitation and sensor noise.
    seconds, rate_hz
        Length and rate; `default_run` if not given.
    recording
        Drive the model with the channels of this series instead of an excitation.

    Raises
    ------
    ModelError
        When the model can't be simulated: it diverges, an input isn't there.
    SetupError
        When the drive says something impossible.
    """
    compiled = model.compile()
    if recording is not None:
        done = simulate(model, recording, seed=drive.seed)
        told: dict[str, Any] = {"kind": "log"}
    else:
        run = default_run(compiled, seconds=seconds, rate_hz=rate_hz)
        name = _input_name(model, compiled, drive.input_name)
        signal = excitation(drive.word, run, level=drive.level, band_hz=drive.band_hz)
        done = simulate(
            model, {name: signal}, duration_s=run.seconds, sample_rate_hz=run.sample_rate_hz, seed=drive.seed
        )
        told = {"kind": drive.word, "input": name, "level": drive.level, "definition": str(signal)}
    recorded = _recorded(done, drive)
    if recording is None:
        recorded = replace(recorded, start_time_ns=START_TIME_NS)
    truth = _truth(model, compiled, done, drive) | {"excitation": told}
    agreement = () if recording is None else _agreement(recording, done)
    return SimulatedLog(simulation=done, recorded=recorded, truth=truth, agreement=agreement)


def write_simulated_log(log: SimulatedLog, path: Path) -> tuple[WrittenLog, Path]:
    """Write the log, its truth in the metadata, and its truth in ``NAME.truth.json`` beside it.

    Returns
    -------
    log, truth
        What was written, and the path of the truth.
    """
    require_log_place(path)
    text = visible_json(json.dumps(log.truth, indent=1, allow_nan=False, ensure_ascii=False))
    written = write_mcap(log.recorded, path, metadata={METADATA_NAME: {"format": TRUTH_FORMAT, "truth": text}})
    beside = path.with_suffix(".truth.json")
    with atomic_write(beside) as file:
        file.write(f"{text}\n".encode())
    return written, beside


def require_log_place(path: Path) -> None:
    """Refuse a path at which no log can be written, before anything is simulated.

    Raises
    ------
    SetupError
        When the name doesn't end with ``.mcap``.
    LogError
        See `chladni.io.atomic.require_place`.
    """
    if path.suffix != ".mcap":
        raise SetupError(f"{path}: a simulated log is written as MCAP; give a name that ends with .mcap")
    require_place(path)


def default_run(compiled: CompiledModel, *, seconds: float | None = None, rate_hz: float | None = None) -> Run:
    """Choose a rate twenty times the highest natural frequency and a run of thirty of the longest decay times.

    Both are rounded up to 1, 2 or 5 times a power of ten; the run is cut at 50 000 samples.
    """
    poles = np.linalg.eigvals(compiled.a) if compiled.states else np.empty(0, dtype=complex)
    # An integrator or a free body never decays: it has no say in how long to look.
    moving = poles[np.abs(poles) > 1e-9 * max(float(np.abs(poles).max(initial=0.0)), 1e-300)]
    if rate_hz is None:
        highest_hz = float(np.abs(moving).max(initial=0.0)) / (2 * pi)
        wanted_hz = _round_up(RATE_OVER_HIGHEST * highest_hz) or RATE_WITHOUT_POLES_HZ
        rate_hz = min(max(wanted_hz, SLOWEST_RATE_HZ), FASTEST_RATE_HZ)
    if seconds is None:
        decaying = -moving.real[moving.real < 0]
        longest_s = 1 / float(decaying.min()) if decaying.size else 0.0
        longest_run_s = MOST_DEFAULT_SAMPLES / rate_hz if 0 < rate_hz < inf else SHORTEST_RUN_S
        seconds = min(max(_round_up(RUN_OVER_DECAY * longest_s), SHORTEST_RUN_S), longest_run_s)
    # Refuses an impossible rate with its own number.
    run = Run(seconds=seconds, sample_rate_hz=rate_hz)
    if rate_hz > FASTEST_LOGGED_HZ:
        raise SetupError(f"rate {rate_hz:g} Hz: a log's stamps count nanoseconds; at most {FASTEST_LOGGED_HZ:g} Hz")
    return run


def _round_up(number: float) -> float:
    """Next number that is 1, 2 or 5 times a power of ten."""
    if number <= 0:
        return 0.0
    power = 10.0 ** floor(log10(number))
    return next((step * power for step in (1, 2, 5) if step * power >= number * (1 - 1e-9)), 10 * power)


def _input_name(model: Model, compiled: CompiledModel, wanted: str | None) -> str:
    names = [terminal.name for terminal in compiled.inputs]
    if not names:
        raise SetupError(f"model {model.name!r} has no input to drive")
    if wanted is None:
        return names[0]
    if wanted not in names:
        raise SetupError(f"model {model.name!r} has no input {wanted!r}; inputs: {', '.join(names)}")
    return wanted


def _agreement(recording: TimeSeries, done: Simulation) -> tuple[Quantity, ...]:
    measured = {channel.name for channel in recording.channels}
    both = [channel.name for channel in done.outputs.channels if channel.name in measured]
    return scores(recording.select(both), done.outputs.select(both)) if both else ()


def _recorded(done: Simulation, drive: Drive) -> TimeSeries:
    """Inputs, then outputs with their sensors' noise."""
    outputs = done.outputs.values
    # A stream of its own: the noise of a run doesn't depend on how much the excitation drew.
    rng = np.random.default_rng([drive.seed, 1])
    deviation = drive.noise * rms(outputs)[:, np.newaxis]
    noisy = outputs + deviation * rng.standard_normal(outputs.shape)
    return replace(
        done.outputs,
        values=np.vstack([done.inputs.values, noisy]),
        channels=(*(replace(channel, role="reference") for channel in done.inputs.channels), *done.outputs.channels),
    )


def _truth(model: Model, compiled: CompiledModel, done: Simulation, drive: Drive) -> dict[str, Any]:
    return {
        "format": TRUTH_FORMAT,
        "model": model.name,
        "kind": model.kind,
        "parameters": {
            name: {"value": parameter.value, "unit": parameter.unit} for name, parameter in model.parameters.items()
        },
        "effects": [_effect(effect) for effect in model.effects],
        "poles": _poles(compiled),
        "noise": drive.noise,
        "seed": drive.seed,
        "sample_rate_hz": done.outputs.sample_rate_hz,
        "duration_s": done.outputs.duration_s,
        "channels": _names_in_the_log(done),
        "flags": list(done.flags),
    }


def _effect(effect: Effect) -> dict[str, Any]:
    told: dict[str, Any] = {"effect": effect.effect, "site": effect.site, "parameters": dict(effect.values)}
    if isinstance(effect, AttachedEffect):
        told |= {"variant": effect.variant, "from": effect.source}
    return told


def _names_in_the_log(done: Simulation) -> list[dict[str, str]]:
    """Which input or output each channel of the log is."""
    channels = [*done.inputs.channels, *done.outputs.channels]
    roles = ["input"] * len(done.inputs.channels) + ["output"] * len(done.outputs.channels)
    places = message_places([channel.name for channel in channels])
    return [
        {"channel": place.name, "role": role, "unit": channel.unit}
        for place, role, channel in zip(places, roles, channels, strict=True)
    ]


def _poles(compiled: CompiledModel) -> list[dict[str, float | None]]:
    """Natural frequency and damping ratio of each pole, pairs once; a pole at zero has no damping ratio."""
    poles = np.linalg.eigvals(compiled.a) if compiled.states else np.empty(0, dtype=complex)
    once: Sequence[complex] = sorted(poles[poles.imag >= 0].tolist(), key=abs)
    return [
        {"frequency_hz": abs(pole) / (2 * pi), "damping_ratio": -pole.real / abs(pole) if abs(pole) > 0 else None}
        for pole in once
    ]
