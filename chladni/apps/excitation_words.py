"""From a word such as ``multisine`` to an excitation that suits a model's rate and the length of a run."""

from dataclasses import dataclass
from typing import Literal, get_args

from chladni.models.excitations.excitation import Excitation
from chladni.models.excitations.impact import Impact
from chladni.models.excitations.multisine import Multisine
from chladni.models.excitations.random_noise import RandomNoise
from chladni.models.excitations.step import Step
from chladni.signals.errors import SetupError

ExcitationWord = Literal["random", "sweep", "multisine", "step", "impact"]

# Share of half the sample rate that is excited when no band is given: below it, samples still draw the signal well.
EXCITED_SHARE = 0.8
# Of a run: periods of a multisine (one is transient), blows of a hammer.
PERIODS, BLOWS = 5, 5
# Samples under a blow's half sine; its spectrum then reaches about a quarter of the sample rate.
BLOW_SAMPLES = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """Length and rate of a simulation."""

    seconds: float
    sample_rate_hz: float

    def __post_init__(self) -> None:
        for name, value in (("seconds", self.seconds), ("rate", self.sample_rate_hz)):
            if not 0 < value < float("inf"):
                raise SetupError(f"{name} {value} must be finite and positive")

    @property
    def samples(self) -> int:
        """Whole samples in the run."""
        return round(self.seconds * self.sample_rate_hz)


def excitation(word: str, run: Run, *, level: float, band_hz: tuple[float, float] | None = None) -> Excitation:
    """Give an excitation for a run.

    Parameters
    ----------
    word
        One of `ExcitationWord`.
    run
        Its length sets period, sweep time and distance of blows; its rate the band.
    level
        Root mean square of noise and multisine, amplitude of a sweep, size of a step, peak of a blow; in the
        input's unit.
    band_hz
        For noise, multisine and sweep; the lower four fifths of half the rate if not given.

    Raises
    ------
    SetupError
        When the word is unknown, or a band is given to what has none.
    """
    high_hz = EXCITED_SHARE * run.sample_rate_hz / 2
    match word:
        case "random":
            return RandomNoise(rms=level, band_hz=band_hz or (1 / run.seconds, high_hz))
        case "multisine":
            period_s = max(run.samples // PERIODS, 4) / run.sample_rate_hz
            return Multisine(rms=level, period_s=period_s, band_hz=band_hz or (1 / period_s, high_hz))
        case "sweep":
            # SciPy's chirp comes with all of scipy.signal, most of a second to import.
            from chladni.models.excitations.swept_sine import SweptSine

            low_hz, high_hz = band_hz or (high_hz / 1000, high_hz)
            return SweptSine(amplitude=level, start_hz=low_hz, end_hz=high_hz, law="logarithmic")
    if band_hz is not None:
        raise SetupError(f"a band has no meaning for {word}; give it with random, multisine or sweep")
    if word == "step":
        return Step(size=level)
    if word == "impact":
        return Impact(peak=level, width_s=BLOW_SAMPLES / run.sample_rate_hz, every_s=run.seconds / BLOWS)
    raise SetupError(f"input {word!r} is none of {', '.join(get_args(ExcitationWord))}")
