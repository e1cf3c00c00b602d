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
    "notebook": "chladni.apps.bench",
    "make_demo_log": "chladni.apps.demo_log",
    "diagnose_gap": "chladni.apps.diagnose",
    "explained_model": "chladni.apps.explained_model",
    "tuned_model": "chladni.apps.explained_model",
    "LevelLocation": "chladni.apps.level_location",
    "locate_from_levels": "chladni.apps.level_location",
    "live": "chladni.apps.live",
    "identify_modes": "chladni.apps.modes",
    "ModePicking": "chladni.apps.picking",
    "pick_modes": "chladni.apps.picking",
    "plot": "chladni.apps.plot",
    "show": "chladni.apps.show",
    "write_report": "chladni.apps.show",
    "frf": "chladni.apps.spectra",
    "psd": "chladni.apps.spectra",
    "compare_levels": "chladni.gap.comparison.levels",
    "diagnose_simulator": "chladni.gap.diagnosis.of_simulator",
    "explained_simulator": "chladni.gap.diagnosis.of_simulator",
    "Diagnosis": "chladni.gap.records.diagnosis",
    "Measurement": "chladni.gap.records.measurement",
    "callable_simulator": "chladni.gap.simulators.callable_simulator",
    "MujocoSimulator": "chladni.gap.simulators.mujoco_simulator",
    "mujoco_simulator": "chladni.gap.simulators.mujoco_simulator",
    "read_uff_modes": "chladni.io.files.uff_modes",
    "write_uff": "chladni.io.files.uff_modes",
    "write_uff_modes": "chladni.io.files.uff_modes",
    "Log": "chladni.io.log",
    "open": "chladni.io.log",
    "open_log": "chladni.io.log",
    "write_mcap": "chladni.io.mcap.writer",
    "load_setup": "chladni.io.setup",
    "StudyResults": "chladni.io.study.results",
    "results": "chladni.io.study.results",
    "DeflectionShape": "chladni.modal.checks.deflection_shapes",
    "deflection_shape": "chladni.modal.checks.deflection_shapes",
    "phase_referenced_shape": "chladni.modal.checks.deflection_shapes",
    "check_driving_point": "chladni.modal.checks.driving_point",
    "check_linearity": "chladni.modal.checks.linearity",
    "check_reciprocity": "chladni.modal.checks.reciprocity",
    "join_references": "chladni.modal.checks.roving",
    "roving_hammer": "chladni.modal.checks.roving",
    "CircleFit": "chladni.modal.experimental.circle_fit",
    "HalfPower": "chladni.modal.experimental.half_power",
    "PolyReferenceLeastSquares": "chladni.modal.experimental.polyreference",
    "unit_modal_mass_shapes": "chladni.modal.fit.scaling",
    "EnhancedFrequencyDomainDecomposition": "chladni.modal.operational.efdd",
    "FrequencyDomainDecomposition": "chladni.modal.operational.fdd",
    "machine_harmonics": "chladni.modal.operational.harmonics",
    "merge_setups": "chladni.modal.operational.setups",
    "CovarianceDrivenSubspace": "chladni.modal.operational.subspace",
    "best_joint": "chladni.modal.shapes.joint_treatment",
    "treatments": "chladni.modal.shapes.joint_treatment",
    "mac": "chladni.modal.shapes.mac",
    "relative_motion": "chladni.modal.shapes.relative_motion",
    "shape_transmissibility": "chladni.modal.shapes.shape_transmissibility",
    "validate": "chladni.modal.shapes.validation",
    "Damper": "chladni.models.analysis.damper_placement",
    "place_damper": "chladni.models.analysis.damper_placement",
    "influence": "chladni.models.analysis.influence",
    "optimise": "chladni.models.analysis.optimise",
    "Wish": "chladni.models.analysis.wish",
    "Model": "chladni.models.core.model",
    "Parameter": "chladni.models.core.parameter",
    "Parameters": "chladni.models.core.parameter",
    "Port": "chladni.models.core.port",
    "Terminal": "chladni.models.core.port",
    "InfluenceTable": "chladni.models.core.reading",
    "Simulation": "chladni.models.core.simulation",
    "DRIVES": "chladni.models.drives.catalogue",
    "drive_model": "chladni.models.drives.drive_model",
    "mr_damper_at": "chladni.models.drives.mr_damper",
    "fit_mr_damper": "chladni.models.drives.mr_damper_fit",
    "mr_record": "chladni.models.drives.mr_record",
    "attached": "chladni.models.effects.attached_effect",
    "LawAtPort": "chladni.models.effects.attaching",
    "EFFECTS": "chladni.models.effects.catalogue:CATALOGUE",
    "Clues": "chladni.models.effects.clues",
    "EffectKind": "chladni.models.effects.effect_kind",
    "Variant": "chladni.models.effects.effect_kind",
    "ELEMENTS": "chladni.models.elements.catalogue",
    "Multisine": "chladni.models.excitations.multisine",
    "RandomNoise": "chladni.models.excitations.random_noise",
    "load_model": "chladni.models.files.model_file",
    "write_model": "chladni.models.files.model_file",
    "INSTRUMENTS": "chladni.models.instruments.catalogue",
    "arm_model": "chladni.models.instruments.robot_arm",
    "force_along_motion": "chladni.models.integrator.known_motion",
    "simulate": "chladni.models.integrator.simulate",
    "Block": "chladni.models.schemes.block",
    "element_block": "chladni.models.schemes.block",
    "SchemeModel": "chladni.models.schemes.scheme_model",
    "SchemeOutput": "chladni.models.schemes.scheme_output",
    "robot_arm": "chladni.models.structures.robot_arm",
    "StructureInput": "chladni.models.structures.structure_input",
    "StructureModel": "chladni.models.structures.structure_model",
    "StructureOutput": "chladni.models.structures.structure_output",
    "excite": "chladni.robots.excite",
    "joint_log": "chladni.robots.joint_log",
    "load_robot": "chladni.robots.loading",
    "write_trajectory": "chladni.robots.trajectory",
    "Cepstrum": "chladni.signals.cepstrum",
    "Channel": "chladni.signals.channel",
    "Coherence": "chladni.signals.coherence",
    "CrossCorrelation": "chladni.signals.cross_correlation",
    "TimeDelays": "chladni.signals.cross_correlation",
    "CrossSpectra": "chladni.signals.cross_spectra",
    "DeflectionShapes": "chladni.signals.deflection_shapes",
    "Bearing": "chladni.signals.envelope",
    "EnvelopeSpectrum": "chladni.signals.envelope",
    "Kurtogram": "chladni.signals.envelope",
    "ChladniError": "chladni.signals.errors",
    "EstimateError": "chladni.signals.errors",
    "LogError": "chladni.signals.errors",
    "ModelError": "chladni.signals.errors",
    "SetupError": "chladni.signals.errors",
    "FilteredSeries": "chladni.signals.filtered_series",
    "FrequencyResponse": "chladni.signals.frequency_response",
    "Geometry": "chladni.signals.geometry",
    "Levels": "chladni.signals.levels",
    "OctaveLevels": "chladni.signals.levels",
    "Severity": "chladni.signals.levels",
    "ModalAssurance": "chladni.signals.modal_assurance",
    "ModeSet": "chladni.signals.mode_set",
    "OrderCuts": "chladni.signals.order_spectra",
    "OrderMap": "chladni.signals.order_spectra",
    "Peak": "chladni.signals.peak",
    "PowerSpectralDensity": "chladni.signals.power_spectral_density",
    "Provenance": "chladni.signals.provenance",
    "ProbabilityDensity": "chladni.signals.random_vibration",
    "ProfileCheck": "chladni.signals.random_vibration",
    "RandomProfile": "chladni.signals.random_vibration",
    "VibrationResponse": "chladni.signals.random_vibration",
    "Rotation": "chladni.signals.rotation",
    "ShockResponse": "chladni.signals.shock_response",
    "SineCheck": "chladni.signals.sine_vibration",
    "SineProfile": "chladni.signals.sine_vibration",
    "StabilisationDiagram": "chladni.signals.stabilisation_diagram",
    "Study": "chladni.signals.study",
    "TimeSeries": "chladni.signals.time_series",
    "Waterfall": "chladni.signals.waterfall",
    "CrossSpectraAccumulator": "chladni.spectral.accumulator",
    "AmplitudeSpectrum": "chladni.spectral.amplitude_spectrum",
    "amplitude_spectrum": "chladni.spectral.amplitude_spectrum",
    "BandLevels": "chladni.signals.levels",
    "band_rms": "chladni.spectral.bands",
    "cepstrum": "chladni.spectral.cepstrum",
    "coherence": "chladni.spectral.coherence",
    "partial_coherence": "chladni.spectral.coherence",
    "cross_spectra": "chladni.spectral.cross_spectra",
    "deflection_shapes": "chladni.spectral.deflection",
    "cross_correlation": "chladni.spectral.delay",
    "time_delay": "chladni.spectral.delay",
    "envelope": "chladni.spectral.envelope",
    "bandpass": "chladni.spectral.filters",
    "bandstop": "chladni.spectral.filters",
    "highpass": "chladni.spectral.filters",
    "lowpass": "chladni.spectral.filters",
    "convert_form": "chladni.spectral.forms",
    "find_impacts": "chladni.spectral.impact",
    "impact_cross_spectra": "chladni.spectral.impact",
    "differentiate": "chladni.spectral.integration",
    "differentiate_density": "chladni.spectral.integration",
    "integrate": "chladni.spectral.integration",
    "integrate_density": "chladni.spectral.integration",
    "kurtogram": "chladni.spectral.kurtogram",
    "levels": "chladni.spectral.levels",
    "octaves": "chladni.spectral.octaves",
    "order_cuts": "chladni.spectral.orders",
    "order_map": "chladni.spectral.orders",
    "find_peaks": "chladni.spectral.peaks",
    "find_response_peaks": "chladni.spectral.peaks",
    "check_profile": "chladni.spectral.random_vibration",
    "probability_density": "chladni.spectral.random_vibration",
    "random_profile": "chladni.spectral.random_vibration",
    "vibration_response": "chladni.spectral.random_vibration",
    "rotation": "chladni.spectral.rotation",
    "severity": "chladni.spectral.severity",
    "srs": "chladni.spectral.shock",
    "check_sine": "chladni.spectral.sine_vibration",
    "sine_limits": "chladni.spectral.sine_vibration",
    "sine_profile": "chladni.spectral.sine_vibration",
    "transmissibility": "chladni.spectral.transmissibility",
    "transmissibility_along": "chladni.spectral.transmissibility",
    "waterfall": "chladni.spectral.waterfall",
    "zoom_spectrum": "chladni.spectral.zoom",
    "Album": "chladni.viewers.figures.album",
    "save_figures": "chladni.viewers.figures.saving",
}

__all__ = [
    "DRIVES",
    "EFFECTS",
    "ELEMENTS",
    "INSTRUMENTS",
    "Album",
    "AmplitudeSpectrum",
    "BandLevels",
    "Bearing",
    "Block",
    "Cepstrum",
    "Channel",
    "ChladniError",
    "CircleFit",
    "Clues",
    "Coherence",
    "CovarianceDrivenSubspace",
    "CrossCorrelation",
    "CrossSpectra",
    "CrossSpectraAccumulator",
    "Damper",
    "DeflectionShape",
    "DeflectionShapes",
    "Diagnosis",
    "EffectKind",
    "EnhancedFrequencyDomainDecomposition",
    "EnvelopeSpectrum",
    "EstimateError",
    "FilteredSeries",
    "FrequencyDomainDecomposition",
    "FrequencyResponse",
    "Geometry",
    "HalfPower",
    "InfluenceTable",
    "Kurtogram",
    "LawAtPort",
    "LevelLocation",
    "Levels",
    "Log",
    "LogError",
    "Measurement",
    "ModalAssurance",
    "ModePicking",
    "ModeSet",
    "Model",
    "ModelError",
    "MujocoSimulator",
    "Multisine",
    "OctaveLevels",
    "OrderCuts",
    "OrderMap",
    "Parameter",
    "Parameters",
    "Peak",
    "PolyReferenceLeastSquares",
    "Port",
    "PowerSpectralDensity",
    "ProbabilityDensity",
    "ProfileCheck",
    "Provenance",
    "RandomNoise",
    "RandomProfile",
    "Rotation",
    "SchemeModel",
    "SchemeOutput",
    "SetupError",
    "Severity",
    "ShockResponse",
    "Simulation",
    "SineCheck",
    "SineProfile",
    "StabilisationDiagram",
    "StructureInput",
    "StructureModel",
    "StructureOutput",
    "Study",
    "StudyResults",
    "Terminal",
    "TimeDelays",
    "TimeSeries",
    "Variant",
    "VibrationResponse",
    "Waterfall",
    "Wish",
    "amplitude_spectrum",
    "analyse",
    "arm_model",
    "attached",
    "band_rms",
    "bandpass",
    "bandstop",
    "best_joint",
    "callable_simulator",
    "cepstrum",
    "check_driving_point",
    "check_linearity",
    "check_profile",
    "check_reciprocity",
    "check_sine",
    "coherence",
    "compare_levels",
    "convert_form",
    "cross_correlation",
    "cross_spectra",
    "deflection_shape",
    "deflection_shapes",
    "diagnose_gap",
    "diagnose_simulator",
    "differentiate",
    "differentiate_density",
    "drive_model",
    "element_block",
    "envelope",
    "excite",
    "explained_model",
    "explained_simulator",
    "find_impacts",
    "find_peaks",
    "find_response_peaks",
    "fit_mr_damper",
    "force_along_motion",
    "frf",
    "highpass",
    "identify_modes",
    "impact_cross_spectra",
    "influence",
    "integrate",
    "integrate_density",
    "join_references",
    "joint_log",
    "kurtogram",
    "levels",
    "live",
    "load_model",
    "load_robot",
    "load_setup",
    "locate_from_levels",
    "lowpass",
    "mac",
    "machine_harmonics",
    "make_demo_log",
    "merge_setups",
    "mr_damper_at",
    "mr_record",
    "mujoco_simulator",
    "notebook",
    "octaves",
    "open",
    "open_log",
    "optimise",
    "order_cuts",
    "order_map",
    "partial_coherence",
    "phase_referenced_shape",
    "pick_modes",
    "place_damper",
    "plot",
    "probability_density",
    "psd",
    "random_profile",
    "read_uff_modes",
    "relative_motion",
    "results",
    "robot_arm",
    "rotation",
    "roving_hammer",
    "save_figures",
    "severity",
    "shape_transmissibility",
    "show",
    "simulate",
    "sine_limits",
    "sine_profile",
    "srs",
    "time_delay",
    "transmissibility",
    "transmissibility_along",
    "treatments",
    "tuned_model",
    "unit_modal_mass_shapes",
    "validate",
    "vibration_response",
    "waterfall",
    "write_mcap",
    "write_model",
    "write_report",
    "write_trajectory",
    "write_uff",
    "write_uff_modes",
    "zoom_spectrum",
]

# What values call to be drawn and made into tables.
_register(
    pick="chladni.apps.picking",
    plot="chladni.apps.plot",
    png="chladni.apps.plot",
    summary="chladni.viewers.gap_summary",
    to_csv="chladni.io.frames",
    to_pandas="chladni.io.frames",
    to_xarray="chladni.io.frames",
)

if TYPE_CHECKING:
    from chladni.apps.analyse import analyse
    from chladni.apps.bench import notebook
    from chladni.apps.demo_log import make_demo_log
    from chladni.apps.diagnose import diagnose_gap
    from chladni.apps.explained_model import explained_model, tuned_model
    from chladni.apps.level_location import LevelLocation, locate_from_levels
    from chladni.apps.live import live
    from chladni.apps.modes import identify_modes
    from chladni.apps.picking import ModePicking, pick_modes
    from chladni.apps.plot import plot
    from chladni.apps.show import show, write_report
    from chladni.apps.spectra import frf, psd
    from chladni.gap.comparison.levels import compare_levels
    from chladni.gap.diagnosis.of_simulator import diagnose_simulator, explained_simulator
    from chladni.gap.records.diagnosis import Diagnosis
    from chladni.gap.records.measurement import Measurement
    from chladni.gap.simulators.callable_simulator import callable_simulator
    from chladni.gap.simulators.mujoco_simulator import MujocoSimulator, mujoco_simulator
    from chladni.io.files.uff_modes import read_uff_modes, write_uff, write_uff_modes
    from chladni.io.log import Log, open, open_log  # noqa: A004  # as chladni.open
    from chladni.io.mcap.writer import write_mcap
    from chladni.io.setup import load_setup
    from chladni.io.study.results import StudyResults, results
    from chladni.modal.checks.deflection_shapes import DeflectionShape, deflection_shape, phase_referenced_shape
    from chladni.modal.checks.driving_point import check_driving_point
    from chladni.modal.checks.linearity import check_linearity
    from chladni.modal.checks.reciprocity import check_reciprocity
    from chladni.modal.checks.roving import join_references, roving_hammer
    from chladni.modal.experimental.circle_fit import CircleFit
    from chladni.modal.experimental.half_power import HalfPower
    from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
    from chladni.modal.fit.scaling import unit_modal_mass_shapes
    from chladni.modal.operational.efdd import EnhancedFrequencyDomainDecomposition
    from chladni.modal.operational.fdd import FrequencyDomainDecomposition
    from chladni.modal.operational.harmonics import machine_harmonics
    from chladni.modal.operational.setups import merge_setups
    from chladni.modal.operational.subspace import CovarianceDrivenSubspace
    from chladni.modal.shapes.joint_treatment import best_joint, treatments
    from chladni.modal.shapes.mac import mac
    from chladni.modal.shapes.relative_motion import relative_motion
    from chladni.modal.shapes.shape_transmissibility import shape_transmissibility
    from chladni.modal.shapes.validation import validate
    from chladni.models.analysis.damper_placement import Damper, place_damper
    from chladni.models.analysis.influence import influence
    from chladni.models.analysis.optimise import optimise
    from chladni.models.analysis.wish import Wish
    from chladni.models.core.model import Model
    from chladni.models.core.parameter import Parameter, Parameters
    from chladni.models.core.port import Port, Terminal
    from chladni.models.core.reading import InfluenceTable
    from chladni.models.core.simulation import Simulation
    from chladni.models.drives.catalogue import DRIVES
    from chladni.models.drives.drive_model import drive_model
    from chladni.models.drives.mr_damper import mr_damper_at
    from chladni.models.drives.mr_damper_fit import fit_mr_damper
    from chladni.models.drives.mr_record import mr_record
    from chladni.models.effects.attached_effect import attached
    from chladni.models.effects.attaching import LawAtPort
    from chladni.models.effects.catalogue import CATALOGUE as EFFECTS
    from chladni.models.effects.clues import Clues
    from chladni.models.effects.effect_kind import EffectKind, Variant
    from chladni.models.elements.catalogue import ELEMENTS
    from chladni.models.excitations.multisine import Multisine
    from chladni.models.excitations.random_noise import RandomNoise
    from chladni.models.files.model_file import load_model, write_model
    from chladni.models.instruments.catalogue import INSTRUMENTS
    from chladni.models.instruments.robot_arm import arm_model
    from chladni.models.integrator.known_motion import force_along_motion
    from chladni.models.integrator.simulate import simulate
    from chladni.models.schemes.block import Block, element_block
    from chladni.models.schemes.scheme_model import SchemeModel
    from chladni.models.schemes.scheme_output import SchemeOutput
    from chladni.models.structures.robot_arm import robot_arm
    from chladni.models.structures.structure_input import StructureInput
    from chladni.models.structures.structure_model import StructureModel
    from chladni.models.structures.structure_output import StructureOutput
    from chladni.robots.excite import excite
    from chladni.robots.joint_log import joint_log
    from chladni.robots.loading import load_robot
    from chladni.robots.trajectory import write_trajectory
    from chladni.signals.cepstrum import Cepstrum
    from chladni.signals.channel import Channel
    from chladni.signals.coherence import Coherence
    from chladni.signals.cross_correlation import CrossCorrelation, TimeDelays
    from chladni.signals.cross_spectra import CrossSpectra
    from chladni.signals.deflection_shapes import DeflectionShapes
    from chladni.signals.envelope import Bearing, EnvelopeSpectrum, Kurtogram
    from chladni.signals.errors import ChladniError, EstimateError, LogError, ModelError, SetupError
    from chladni.signals.filtered_series import FilteredSeries
    from chladni.signals.frequency_response import FrequencyResponse
    from chladni.signals.geometry import Geometry
    from chladni.signals.levels import BandLevels, Levels, OctaveLevels, Severity
    from chladni.signals.modal_assurance import ModalAssurance
    from chladni.signals.mode_set import ModeSet
    from chladni.signals.order_spectra import OrderCuts, OrderMap
    from chladni.signals.peak import Peak
    from chladni.signals.power_spectral_density import PowerSpectralDensity
    from chladni.signals.provenance import Provenance
    from chladni.signals.random_vibration import ProbabilityDensity, ProfileCheck, RandomProfile, VibrationResponse
    from chladni.signals.rotation import Rotation
    from chladni.signals.shock_response import ShockResponse
    from chladni.signals.sine_vibration import SineCheck, SineProfile
    from chladni.signals.stabilisation_diagram import StabilisationDiagram
    from chladni.signals.study import Study
    from chladni.signals.time_series import TimeSeries
    from chladni.signals.waterfall import Waterfall
    from chladni.spectral.accumulator import CrossSpectraAccumulator
    from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum, amplitude_spectrum
    from chladni.spectral.bands import band_rms
    from chladni.spectral.cepstrum import cepstrum
    from chladni.spectral.coherence import coherence, partial_coherence
    from chladni.spectral.cross_spectra import cross_spectra
    from chladni.spectral.deflection import deflection_shapes
    from chladni.spectral.delay import cross_correlation, time_delay
    from chladni.spectral.envelope import envelope
    from chladni.spectral.filters import bandpass, bandstop, highpass, lowpass
    from chladni.spectral.forms import convert_form
    from chladni.spectral.impact import find_impacts, impact_cross_spectra
    from chladni.spectral.integration import differentiate, differentiate_density, integrate, integrate_density
    from chladni.spectral.kurtogram import kurtogram
    from chladni.spectral.levels import levels
    from chladni.spectral.octaves import octaves
    from chladni.spectral.orders import order_cuts, order_map
    from chladni.spectral.peaks import find_peaks, find_response_peaks
    from chladni.spectral.random_vibration import (
        check_profile,
        probability_density,
        random_profile,
        vibration_response,
    )
    from chladni.spectral.rotation import rotation
    from chladni.spectral.severity import severity
    from chladni.spectral.shock import srs
    from chladni.spectral.sine_vibration import check_sine, sine_limits, sine_profile
    from chladni.spectral.transmissibility import transmissibility, transmissibility_along
    from chladni.spectral.waterfall import waterfall
    from chladni.spectral.zoom import zoom_spectrum
    from chladni.viewers.figures.album import Album
    from chladni.viewers.figures.saving import save_figures
else:

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used."""
        from importlib import import_module

        if name not in _HOME:
            raise AttributeError(f"module 'chladni' has no attribute {name!r}")
        module, _, called = _HOME[name].partition(":")
        value = getattr(import_module(module), called or name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
