"""A virtual Fourier analyser: acceleration logs to spectra, transfer functions and modes; simulated drives beside.

::

    log = chladni.open("arm.mcap")                              # lazy: nothing decoded yet; data files, too
    frf = chladni.frf(log, references="/hammer.wrench.force.x", resolution_hz=0.5)
    modes = chladni.identify_modes(frf, band_hz=(10, 400))
    chladni.show(log, frf, modes)                               # rerun

    model = chladni.load_model("arm.toml")                      # what the simulation believes
    run = chladni.simulate(model, log.read())                   # driven by the log's own inputs
    found = chladni.diagnose_gap(model, log)                    # what the simulation forgot, and how far that closes

The names below are the public surface; each is imported when it is first used, so that ``import chladni`` is cheap.
"""

from typing import TYPE_CHECKING

from chladni.signals.outlets import register as _register

__version__ = "0.1.0"

# Public name -> module that defines it.
_HOME = {
    "analyse": "chladni.apps.analyse",
    "diagnose_gap": "chladni.apps.diagnose",
    "locate_from_levels": "chladni.apps.level_location",
    "frf": "chladni.apps.spectra",
    "identify_modes": "chladni.apps.modes",
    "psd": "chladni.apps.spectra",
    "plot": "chladni.apps.plot",
    "show": "chladni.apps.show",
    "find_peaks": "chladni.spectral.peaks",
    "find_response_peaks": "chladni.spectral.peaks",
    "cross_spectra": "chladni.spectral.cross_spectra",
    "coherence": "chladni.spectral.coherence",
    "waterfall": "chladni.spectral.waterfall",
    "levels": "chladni.spectral.levels",
    "severity": "chladni.spectral.severity",
    "octaves": "chladni.spectral.octaves",
    "cepstrum": "chladni.spectral.cepstrum",
    "envelope": "chladni.spectral.envelope",
    "kurtogram": "chladni.spectral.kurtogram",
    "mac": "chladni.modal.shapes.mac",
    "relative_motion": "chladni.modal.shapes.relative_motion",
    "validate": "chladni.modal.shapes.validation",
    "CircleFit": "chladni.modal.experimental.circle_fit",
    "CovarianceDrivenSubspace": "chladni.modal.operational.subspace",
    "EnhancedFrequencyDomainDecomposition": "chladni.modal.operational.efdd",
    "FrequencyDomainDecomposition": "chladni.modal.operational.fdd",
    "HalfPower": "chladni.modal.experimental.half_power",
    "PolyReferenceLeastSquares": "chladni.modal.experimental.polyreference",
    "attached": "chladni.models.effects.attached_effect",
    "influence": "chladni.models.analysis.influence",
    "load_model": "chladni.models.files.model_file",
    "optimise": "chladni.models.analysis.optimise",
    "simulate": "chladni.models.integrator.simulate",
    "write_model": "chladni.models.files.model_file",
    "Wish": "chladni.models.analysis.wish",
    "excite": "chladni.robots.excite",
    "load_robot": "chladni.robots.loading",
    "load_setup": "chladni.io.setup",
    "open": "chladni.io.log",
    "open_log": "chladni.io.log",
    "write_mcap": "chladni.io.mcap.writer",
    "Channel": "chladni.signals.channel",
    "Coherence": "chladni.signals.coherence",
    "CrossSpectra": "chladni.signals.cross_spectra",
    "Levels": "chladni.signals.levels",
    "OctaveLevels": "chladni.signals.levels",
    "Bearing": "chladni.signals.envelope",
    "Cepstrum": "chladni.signals.cepstrum",
    "EnvelopeSpectrum": "chladni.signals.envelope",
    "Kurtogram": "chladni.signals.envelope",
    "Severity": "chladni.signals.levels",
    "FrequencyResponse": "chladni.signals.frequency_response",
    "ModalAssurance": "chladni.signals.modal_assurance",
    "ModeSet": "chladni.signals.mode_set",
    "PowerSpectralDensity": "chladni.signals.power_spectral_density",
    "Study": "chladni.signals.study",
    "TimeSeries": "chladni.signals.time_series",
    "ChladniError": "chladni.signals.errors",
    "EstimateError": "chladni.signals.errors",
    "LogError": "chladni.signals.errors",
    "ModelError": "chladni.signals.errors",
    "SetupError": "chladni.signals.errors",
}

__all__ = [
    "Bearing",
    "Cepstrum",
    "Channel",
    "ChladniError",
    "CircleFit",
    "Coherence",
    "CovarianceDrivenSubspace",
    "CrossSpectra",
    "EnhancedFrequencyDomainDecomposition",
    "EnvelopeSpectrum",
    "EstimateError",
    "FrequencyDomainDecomposition",
    "FrequencyResponse",
    "HalfPower",
    "Kurtogram",
    "Levels",
    "LogError",
    "ModalAssurance",
    "ModeSet",
    "ModelError",
    "OctaveLevels",
    "PolyReferenceLeastSquares",
    "PowerSpectralDensity",
    "SetupError",
    "Severity",
    "Study",
    "TimeSeries",
    "Wish",
    "analyse",
    "attached",
    "cepstrum",
    "coherence",
    "cross_spectra",
    "diagnose_gap",
    "envelope",
    "excite",
    "find_peaks",
    "find_response_peaks",
    "frf",
    "identify_modes",
    "influence",
    "kurtogram",
    "levels",
    "load_model",
    "load_robot",
    "load_setup",
    "locate_from_levels",
    "mac",
    "octaves",
    "open",
    "open_log",
    "optimise",
    "plot",
    "psd",
    "relative_motion",
    "severity",
    "show",
    "simulate",
    "validate",
    "waterfall",
    "write_mcap",
    "write_model",
]

# What values call to be drawn and made into tables.
_register(
    plot="chladni.apps.plot",
    png="chladni.apps.plot",
    to_csv="chladni.io.frames",
    to_pandas="chladni.io.frames",
    to_xarray="chladni.io.frames",
)

if TYPE_CHECKING:
    from chladni.apps.analyse import analyse
    from chladni.apps.diagnose import diagnose_gap
    from chladni.apps.level_location import locate_from_levels
    from chladni.apps.modes import identify_modes
    from chladni.apps.plot import plot
    from chladni.apps.show import show
    from chladni.apps.spectra import frf, psd
    from chladni.io.log import open, open_log  # noqa: A004  # as chladni.open
    from chladni.io.mcap.writer import write_mcap
    from chladni.io.setup import load_setup
    from chladni.modal.experimental.circle_fit import CircleFit
    from chladni.modal.experimental.half_power import HalfPower
    from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
    from chladni.modal.operational.efdd import EnhancedFrequencyDomainDecomposition
    from chladni.modal.operational.fdd import FrequencyDomainDecomposition
    from chladni.modal.operational.subspace import CovarianceDrivenSubspace
    from chladni.modal.shapes.mac import mac
    from chladni.modal.shapes.relative_motion import relative_motion
    from chladni.modal.shapes.validation import validate
    from chladni.models.analysis.influence import influence
    from chladni.models.analysis.optimise import optimise
    from chladni.models.analysis.wish import Wish
    from chladni.models.effects.attached_effect import attached
    from chladni.models.files.model_file import load_model, write_model
    from chladni.models.integrator.simulate import simulate
    from chladni.robots.excite import excite
    from chladni.robots.loading import load_robot
    from chladni.signals.cepstrum import Cepstrum
    from chladni.signals.channel import Channel
    from chladni.signals.coherence import Coherence
    from chladni.signals.cross_spectra import CrossSpectra
    from chladni.signals.envelope import Bearing, EnvelopeSpectrum, Kurtogram
    from chladni.signals.errors import ChladniError, EstimateError, LogError, ModelError, SetupError
    from chladni.signals.frequency_response import FrequencyResponse
    from chladni.signals.levels import Levels, OctaveLevels, Severity
    from chladni.signals.modal_assurance import ModalAssurance
    from chladni.signals.mode_set import ModeSet
    from chladni.signals.power_spectral_density import PowerSpectralDensity
    from chladni.signals.study import Study
    from chladni.signals.time_series import TimeSeries
    from chladni.spectral.cepstrum import cepstrum
    from chladni.spectral.coherence import coherence
    from chladni.spectral.cross_spectra import cross_spectra
    from chladni.spectral.envelope import envelope
    from chladni.spectral.kurtogram import kurtogram
    from chladni.spectral.levels import levels
    from chladni.spectral.octaves import octaves
    from chladni.spectral.peaks import find_peaks, find_response_peaks
    from chladni.spectral.severity import severity
    from chladni.spectral.waterfall import waterfall
else:

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        from importlib import import_module

        if name not in _HOME:
            raise AttributeError(f"module 'chladni' has no attribute {name!r}")
        value = getattr(import_module(_HOME[name]), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
