"""Base vibration: the floor shakes, and no channel of the log tells."""

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.band_noise import BandNoise
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.generated_signal import with_generated
from chladni.models.effects.linear_feedback import with_feedback
from chladni.signals.arrays import Real


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Let a computed acceleration act where the ground's acceleration acts."""
    port = compiled.port_index(site.name, "ground")
    # A record, not a closure: a model goes to other processes.
    noise = BandNoise(
        level=values["level"], low_hz=values["band_start"], high_hz=values["band"], seed=int(values["seed"])
    )
    unit = compiled.ports[port].unit
    compiled, shaking = with_generated(compiled, name=f"{site.name}.{site.effect}", unit=unit, samples=noise)
    return with_feedback(compiled, port, shaking)[0]


def _check(values: Values) -> str:
    if values["band_start"] >= values["band"]:
        return f"band_start = {values['band_start']:g} Hz must be below band = {values['band']:g} Hz"
    # Parameters are real numbers; a seed of 1.5 would silently be 1.
    if values["seed"] != int(values["seed"]):
        return f"seed = {values['seed']:g} must be a whole number"
    return ""


#: Share of the power that is left out at either end of a band: tails there are the estimate's, not the floor's.
_TAIL = 0.05
#: Share of a force's power that the strongest hundredth of its lines, from this share on, holds of tones alone.
_TONES, _LINES = 0.9, 0.99


def _of_force(acceleration: Real, sample_rate_hz: float) -> Values:
    power = np.sort(np.abs(np.fft.rfft(acceleration)) ** 2)
    if power[int(_LINES * power.size) :].sum() > _TONES * power.sum():
        # A few lines: something that turns nearby, and on which side of the mount it stands isn't told.
        return {}
    low_hz, high_hz = flat_band(acceleration, sample_rate_hz)
    return {"level": float(np.sqrt(np.mean(acceleration**2))), "band": high_hz, "band_start": low_hz}


def flat_band(signal: Real, sample_rate_hz: float) -> tuple[float, float]:
    """Give the ends in Hz of the flat band between whose 5th and 95th percentile 90 % of a signal's power lies.

    Examples
    --------
    >>> import numpy as np
    >>> lines = np.zeros(501)
    >>> lines[100:201] = 1.0
    >>> low_hz, high_hz = flat_band(np.fft.irfft(lines), 1000.0)
    >>> f"{low_hz:.0f} to {high_hz:.0f} Hz"
    '100 to 200 Hz'
    """
    power = np.abs(np.fft.rfft(signal)) ** 2
    # A line stands for the frequencies around it.
    edges_hz = (np.arange(power.size + 1) - 0.5) * sample_rate_hz / signal.size
    summed = np.concatenate([[0.0], np.cumsum(power)]) / np.sum(power)
    low_hz, high_hz = np.interp([_TAIL, 1.0 - _TAIL], summed, edges_hz)
    beyond = (high_hz - low_hz) * _TAIL / (1.0 - 2.0 * _TAIL)
    return float(max(low_hz - beyond, 0.0)), float(min(high_hz + beyond, sample_rate_hz / 2.0))


BASE_VIBRATION = EffectKind(
    name="base_vibration",
    family="disturbance",
    meaning="the floor moves: broadband acceleration that is not in the log",
    sites=("ground",),
    parameters=Parameters(
        (
            Parameter(
                name="level", value=0.01, unit="m/s^2", low=0.0, high=10.0, minimum=0.0, maximum=1e6,
                meaning="root mean square of the ground's acceleration",
            ),
            Parameter(
                name="band", value=50.0, unit="Hz", low=1.0, high=1e3, minimum=1e-6, maximum=1e7,
                meaning="upper end of the band, which is flat",
            ),
            Parameter(
                name="band_start", value=1.0, unit="Hz", low=0.0, high=100.0, minimum=0.0, maximum=1e7,
                meaning="lower end",
            ),
            Parameter(
                name="seed", value=0.0, unit="1", low=0.0, high=1000.0, minimum=0.0, maximum=4294967295.0,
                role="function", meaning="which of all such floors; a whole number",
            ),
        )
    ),
    optional=("band_start", "seed"),
    neutral={"level": 0.0},
    check=_check,
    clues=Clues(of_force=_of_force),
    variants=(
        Variant(name="flat", attach=attach, formula="a_ground = level sqrt(2/N) sum_k cos(2 pi f_k t + phase_k)"),
    ),
)  # fmt: skip
