"""The trial of a limit with rounded corners: an actuator's, or the end of a sensor's range."""

from collections.abc import Sequence

from chladni.gap.explanation.trial import Force, Shape, Trial, logarithms, numbers
from chladni.gap.location.recovered import Recovered
from chladni.models.effects.saturation import rounded_samples

#: Widths of a limit's corners over the limit that are tried, and the widest.
_KNEES, _WIDEST_KNEE = (0.08, 0.25), 0.5


def rounded_limit(motion: Recovered, effect: str, limits: Sequence[float]) -> Trial:
    """Give the trial of the word whose variant ``rounded`` shapes the signal at a site, with no free amplitude."""
    signal, rate = motion.displacement, motion.lines.sample_rate_hz

    def build(shape: Shape) -> Force:
        limit, knee = numbers(shape)
        return Force.known(motion.spectrum(rounded_samples(signal, rate, limit, min(knee, _WIDEST_KNEE)) - signal))

    return Trial(
        effect=effect, site=motion.site, variant="rounded", build=build, grid=logarithms(limits, _KNEES),
        values=lambda shape, _: {"limit": numbers(shape)[0], "knee": min(numbers(shape)[1], _WIDEST_KNEE)},
        parameters=2,
    )  # fmt: skip
