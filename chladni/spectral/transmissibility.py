"""Transmissibility: the motion of one point over the motion of another."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from chladni.io.source import SeriesLike
from chladni.signals.channel import Names, as_names, channel_names
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.unit_text import in_unit
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf import frequency_response


def transmissibility(
    source: CrossSpectra | SeriesLike,
    *,
    references: str,
    responses: Names | None = None,
    resolution_hz: float | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> FrequencyResponse:
    """Estimate how motion passes from one point to others, T = response/reference.

    Parameters
    ----------
    source
        Averaged cross-spectra that hold the motions; or a log, the path to one, a series or an array
        ``[channel, sample]``, whose cross-spectra are averaged after Welch first.
    references
        Name of the channel at the point where the motion comes from.
    responses
        Names of the channels it goes to; None takes every other channel in the reference's unit.
    resolution_hz, sample_rate_hz, start_s, end_s
        Of samples: how they are averaged, see `cross_spectra`.

    Returns
    -------
    FrequencyResponse
        Estimator ``T1``, in unit 1, with one sigma and coherence as for H1. Where the coherence is below 1 for want
        of a single path of excitation, T depends on where the structure is excited; noise at the reference makes it
        too small.

    Raises
    ------
    EstimateError
        When a channel is missing, or units differ: their ratio is no transmissibility.

    Notes
    -----
    T1 = G_ref,resp / G_ref,ref: H1 with a motion as its reference, and with the random error of H1.
    """
    if isinstance(source, CrossSpectra):
        spectra = source
    else:
        spectra = cross_spectra(
            source,
            channels=None if responses is None else dict.fromkeys((references, *as_names(responses))),
            resolution_hz=resolution_hz,
            sample_rate_hz=sample_rate_hz,
            start_s=start_s,
            end_s=end_s,
        )
    reference = spectra.channels[spectra.index(references)].name
    unit = spectra.channels[spectra.index(reference)].unit
    if responses is None:
        chosen = [c.name for c in spectra.channels if c.unit == unit and c.name != reference]
    else:
        chosen = list(channel_names(spectra.channels, responses))
    if not chosen:
        raise EstimateError(
            f"no channel but {reference!r} is {in_unit(unit)}; transmissibility needs two in one unit"
        )
    # Checked before arithmetic: a ratio of velocity to acceleration is 1/omega in disguise.
    for name in chosen:
        other = spectra.channels[spectra.index(name)].unit
        if other != unit:
            raise EstimateError(
                f"{name!r} is {in_unit(other)}, {reference!r} {in_unit(unit)}: transmissibility needs one unit; "
                "integrate or differentiate one of them, or ask for a frequency response"
            )
    response = frequency_response(spectra, references=reference, responses=chosen)
    return replace(response, provenance=response.provenance.with_estimator("T1"))


def transmissibility_along(spectra: CrossSpectra, *, path: Sequence[str]) -> tuple[FrequencyResponse, ...]:
    """Estimate how motion passes from each point of a path to the next.

    Parameters
    ----------
    spectra
        Averaged cross-spectra that hold the motions.
    path
        Names of two or more channels, from the source outwards, such as base, column, arm, wrist.

    Returns
    -------
    tuple of FrequencyResponse
        One a step, each as `transmissibility` gives it.

    Raises
    ------
    EstimateError
        When the path has less than two channels, and as for `transmissibility`.
    """
    if len(path) < 2:
        raise EstimateError(f"a path needs two channels or more, got {len(path)}")
    return tuple(transmissibility(spectra, references=near, responses=far) for near, far in pairwise(path))
