"""Which channels are references and which responses."""

from dataclasses import dataclass

from chladni.signals.channel import Names, channel_names
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelChoice:
    """Rows of the references and of the responses in the matrix of cross-spectra."""

    references: list[int]
    responses: list[int]


def choose_channels(spectra: CrossSpectra, references: Names, responses: Names | None) -> ChannelChoice:
    """Find the named channels; responses default to all channels that are no reference.

    Raises
    ------
    EstimateError
        When a channel is missing or named twice, none is left as response, or the spectra are peak-held.
    """
    # Each pair may hold another segment, so that |G_xy|^2 can even exceed G_xx G_yy.
    if spectra.provenance.averaging == "peak-hold":
        raise EstimateError(
            "a peak hold keeps no phase between channels; average linearly for responses and coherence"
        )
    inputs = channel_names(spectra.channels, references)
    outputs = (
        tuple(channel.name for channel in spectra.channels if channel.name not in inputs)
        if responses is None
        else channel_names(spectra.channels, responses)
    )
    # A response may be a reference too (its row is then a column of ones and zeros), but none is asked for twice.
    for role, names in (("reference", inputs), ("response", outputs)):
        if not names:
            raise EstimateError(
                f"no {role} among {', '.join(channel.name for channel in spectra.channels)}; name one"
            )
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise EstimateError(f"{role} {', '.join(sorted(twice))} is named twice; name each channel once")
    return ChannelChoice(
        references=[spectra.index(name) for name in inputs], responses=[spectra.index(name) for name in outputs]
    )
