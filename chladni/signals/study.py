"""All that was found in one log: what viewers and reports draw."""

from dataclasses import dataclass, field

from chladni.signals.cepstrum import Cepstrum
from chladni.signals.channel import Channel
from chladni.signals.envelope import EnvelopeSpectrum
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry
from chladni.signals.levels import Levels, OctaveLevels, Severity
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.relative_motion import RelativeMotion
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Drawn
from chladni.signals.waterfall import Waterfall


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study(Drawn):
    """Results of one analysis, ready to be drawn.

    Attributes
    ----------
    title
        Short name, usually the log's file name.
    series
        Waveforms, one entry a sample rate.
    densities
        Power spectral densities, one entry a sample rate.
    waterfalls
        Spectra over time, one entry a sample rate.
    response
        Transfer functions to the references, or None when there is no reference.
    peaks
        Named peaks of the densities, the highest first.
    response_peaks
        Named peaks of the transfer functions, the highest first.
    modes
        Natural modes, or None when none were looked for.
    validation
        Checks of the modes, or None.
    relative_motion
        Motion between neighbours in each mode, the greatest first.
    levels, severities
        Levels over all and running, and the severity of motions, one entry a sample rate.
    octaves
        Levels in octave bands, one entry a sample rate.
    envelopes
        Envelope spectra, one entry a channel.
    cepstra
        Cepstra, one entry a sample rate.
    geometry
        Where the points sit; empty when no setup file was given.
    findings
        Sentences about the log and its spectra: soundness first, then what was seen, then advice.
    pictures
        Titles and PNGs of what has no place of its own above.
    logs
        Titles of the logs that it was gathered from, with which their channels' names begin; empty of a single one.
    """

    title: str
    series: tuple[TimeSeries, ...] = ()
    densities: tuple[PowerSpectralDensity, ...] = ()
    waterfalls: tuple[Waterfall, ...] = ()
    response: FrequencyResponse | None = None
    peaks: tuple[Peak, ...] = ()
    response_peaks: tuple[Peak, ...] = ()
    modes: ModeSet | None = None
    validation: ModeValidation | None = None
    relative_motion: tuple[RelativeMotion, ...] = ()
    levels: tuple[Levels, ...] = ()
    severities: tuple[Severity, ...] = ()
    octaves: tuple[OctaveLevels, ...] = ()
    envelopes: tuple[EnvelopeSpectrum, ...] = ()
    cepstra: tuple[Cepstrum, ...] = ()
    geometry: Geometry = field(default_factory=Geometry)
    findings: tuple[str, ...] = ()
    pictures: tuple[tuple[str, bytes], ...] = ()
    logs: tuple[str, ...] = ()

    def log_of(self, channel: Channel) -> str:
        """Title of the log that a channel is of; empty when there is one log only."""
        return next((log for log in self.logs if channel.name.startswith(f"{log}: ")), "")
