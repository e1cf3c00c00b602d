"""The trial of a limit with rounded corners: an actuator's, or the end of a sensor's range."""

from collections.abc import Sequence

from chladni.gap.explanation.trial import Force, Shape, Trial, logarithms, numbers
from chladni.gap.location.recovered import Recovered
from chladni.models.effects.saturation import KNEE, rounded_samples

#: Widths of a limit's corners over the limit that are tried.
_KNEES = (0.08, 0.25)


def rounded_limit(motion: Recovered, effect: str, limits: Sequence[float]) -> Trial:
    """Give the trial of the word whose variant ``rounded`` shapes the signal at a site, with no free amplitude."""
    signal, rate = motion.displacement, motion.lines.sample_rate_hz

    def ends(shape: Shape) -> tuple[float, float]:
        limit, knee = numbers(shape)
        return limit, min(knee, KNEE.maximum)

    def build(shape: Shape) -> Force:
        return Force.known(motion.spectrum(rounded_samples(signal, rate, *ends(shape)) - signal))

    return Trial(
        effect=effect, site=motion.site, variant="rounded", build=build, grid=logarithms(limits, _KNEES),
        values=lambda shape, _: dict(zip(("limit", "knee"), ends(shape), strict=True)),
        parameters=2,
    )  # fmt: skip
