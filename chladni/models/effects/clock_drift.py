"""Clock drift: a recorder whose clock has a rate of its own."""

from collections.abc import Iterator

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import SampleShape
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import with_samples_mapped
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers
from chladni.signals.arrays import Real

#: Degree of the spline that runs through the samples.
_DEGREE = 5


def drifted(samples: Real, sample_rate_hz: float, ppm: float, offset: float) -> Real:
    """Give the samples at the times ``t (1 + 1e-6 ppm) + offset``; beyond the ends the last ones hold.

    By a spline of fifth degree through all samples: of a signal below a quarter of the sample rate it misses less
    than 1e-3.
    """
    if samples.size <= _DEGREE or (ppm == 0.0 and offset == 0.0):
        return samples
    # Half a second to import, and few clocks drift.
    from scipy.interpolate import make_interp_spline

    times = np.arange(samples.size, dtype=np.float64)
    there = np.clip(times * (1.0 + 1e-6 * ppm) + offset * sample_rate_hz, 0.0, times[-1])
    return np.asarray(make_interp_spline(times, samples, k=_DEGREE)(there), dtype=np.float64)


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Read the samples at the times of the other clock; what a controller sees is no matter of the recorder."""
    return with_samples_mapped(compiled, site, SampleShape(shape=drifted, numbers=(values["ppm"], values["offset"])))


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    yield from (_trial(motion, sign) for sign in (1.0, -1.0))


def _trial(motion: TrialMotion, sign: float) -> Trial:
    """A clock that runs fast or, with a negative sign, slow: a whole offset, small beside a period, is fitted too."""
    y, rate_hz = motion.displacement, motion.sample_rate_hz

    def build(shape: Shape) -> Force:
        there = drifted(y, rate_hz, sign * numbers(shape)[0], 0.0)
        return Force(
            fixed=motion.spectrum(there - y), basis=np.stack([motion.spectrum(np.gradient(there) * rate_hz)])
        )

    def values(shape: Shape, a: Real) -> Numbers:
        return {"ppm": sign * numbers(shape)[0], "offset": float(a[0])}

    # From a tenth of a sample over the log to sixty.
    grid = 1e6 * np.geomspace(0.1, 60.0, 24) / y.size
    return Trial(build=build, values=values, grid=logarithms(grid.tolist()), parameters=2)


CLOCK_DRIFT = EffectKind(
    name="clock_drift",
    said="a clock drift",
    family="sensor",
    meaning="this channel's clock has a rate of its own",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="ppm", value=50.0, unit="1", low=-1e3, high=1e3, minimum=-1e5, maximum=1e5,
                meaning="how much faster it runs, in millionths: it reads the signal of later times",
            ),
            Parameter(
                name="offset", value=0.0, unit="s", low=-0.1, high=0.1, minimum=-1e3, maximum=1e3,
                meaning="at the log's start; positive: recorded early",
            ),
        )
    ),
    optional=("offset",),
    neutral={"ppm": 0.0, "offset": 0.0},
    clues=Clues(trials=_trials, exact=True),
    variants=(
        Variant(
            name="rate",
            attach=attach,
            formula="y_recorded(t) = y(t (1 + 1e-6 ppm) + offset)",
            fitted=("offset",),
        ),
    ),
)  # fmt: skip
