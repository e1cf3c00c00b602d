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
    "explained_simulator": "chladni.apps.explained_model",
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
    "frf": "chladni.apps.frf",
    "psd": "chladni.apps.psd",
    "compare_levels": "chladni.gap.comparison.levels",
    "diagnose_simulator": "chladni.gap.diagnosis.of_simulator",
    "Diagnosis": "chladni.gap.records.diagnosis",
    "Measurement": "chladni.gap.records.measurement",
    "callable_simulator": "chladni.models.simulators.callable_simulator",
    "MujocoSimulator": "chladni.models.simulators.mujoco_simulator",
    "mujoco_simulator": "chladni.models.simulators.mujoco_simulator",
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
    "DeflectionShape": "chladni.modal.checks.deflection_shape",
    "deflection_shape": "chladni.modal.checks.deflection_shape",
    "phase_referenced_shape": "chladni.modal.checks.deflection_shape",
    "check_driving_point": "chladni.modal.checks.driving_point",
    "check_linearity": "chladni.modal.checks.linearity",
    "check_reciprocity": "chladni.modal.checks.reciprocity",
    "join_references": "chladni.modal.checks.roving",
    "roving_hammer": "chladni.modal.checks.roving",
    "CircleFit": "chladni.modal.experimental.circle_fit",
    "HalfPower": "chladni.modal.experimental.half_power",
    "PolyReferenceLeastSquares": "chladni.modal.experimental.polyreference",
    "unit_modal_mass_shapes": "chladni.modal.fit.modal_mass",
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
    "Bearing": "chladni.spectral.bearings",
    "Cepstrum": "chladni.signals.cepstrum",
    "Channel": "chladni.signals.channel",
    "Coherence": "chladni.signals.coherence",
    "CrossCorrelation": "chladni.signals.cross_correlation",
    "TimeDelays": "chladni.signals.cross_correlation",
    "CrossSpectra": "chladni.signals.cross_spectra",
    "DeflectionShapes": "chladni.signals.deflection_shapes",
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
    "deflection_shapes": "chladni.spectral.ods",
    "cross_correlation": "chladni.spectral.cross_correlation",
    "time_delay": "chladni.spectral.time_delay",
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
    "probability_density": "chladni.spectral.probability_density",
    "random_profile": "chladni.spectral.random_vibration",
    "vibration_response": "chladni.spectral.miles",
    "rotation": "chladni.spectral.rotation",
    "severity": "chladni.spectral.severity",
    "srs": "chladni.spectral.srs",
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

__all__ = list(_HOME)

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
    from chladni.apps.analyse import analyse as analyse
    from chladni.apps.bench import notebook as notebook
    from chladni.apps.demo_log import make_demo_log as make_demo_log
    from chladni.apps.diagnose import diagnose_gap as diagnose_gap
    from chladni.apps.explained_model import explained_model as explained_model
    from chladni.apps.explained_model import explained_simulator as explained_simulator
    from chladni.apps.explained_model import tuned_model as tuned_model
    from chladni.apps.frf import frf as frf
    from chladni.apps.level_location import LevelLocation as LevelLocation
    from chladni.apps.level_location import locate_from_levels as locate_from_levels
    from chladni.apps.live import live as live
    from chladni.apps.modes import identify_modes as identify_modes
    from chladni.apps.picking import ModePicking as ModePicking
    from chladni.apps.picking import pick_modes as pick_modes
    from chladni.apps.plot import plot as plot
    from chladni.apps.psd import psd as psd
    from chladni.apps.show import show as show
    from chladni.apps.show import write_report as write_report
    from chladni.gap.comparison.levels import compare_levels as compare_levels
    from chladni.gap.diagnosis.of_simulator import diagnose_simulator as diagnose_simulator
    from chladni.gap.records.diagnosis import Diagnosis as Diagnosis
    from chladni.gap.records.measurement import Measurement as Measurement
    from chladni.io.files.uff_modes import read_uff_modes as read_uff_modes
    from chladni.io.files.uff_modes import write_uff as write_uff
    from chladni.io.files.uff_modes import write_uff_modes as write_uff_modes
    from chladni.io.log import Log as Log
    from chladni.io.log import open as open  # noqa: A004  # as chladni.open
    from chladni.io.log import open_log as open_log
    from chladni.io.mcap.writer import write_mcap as write_mcap
    from chladni.io.setup import load_setup as load_setup
    from chladni.io.study.results import StudyResults as StudyResults
    from chladni.io.study.results import results as results
    from chladni.modal.checks.deflection_shape import DeflectionShape as DeflectionShape
    from chladni.modal.checks.deflection_shape import deflection_shape as deflection_shape
    from chladni.modal.checks.deflection_shape import phase_referenced_shape as phase_referenced_shape
    from chladni.modal.checks.driving_point import check_driving_point as check_driving_point
    from chladni.modal.checks.linearity import check_linearity as check_linearity
    from chladni.modal.checks.reciprocity import check_reciprocity as check_reciprocity
    from chladni.modal.checks.roving import join_references as join_references
    from chladni.modal.checks.roving import roving_hammer as roving_hammer
    from chladni.modal.experimental.circle_fit import CircleFit as CircleFit
    from chladni.modal.experimental.half_power import HalfPower as HalfPower
    from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares as PolyReferenceLeastSquares
    from chladni.modal.fit.modal_mass import unit_modal_mass_shapes as unit_modal_mass_shapes
    from chladni.modal.operational.efdd import (
        EnhancedFrequencyDomainDecomposition as EnhancedFrequencyDomainDecomposition,
    )
    from chladni.modal.operational.fdd import FrequencyDomainDecomposition as FrequencyDomainDecomposition
    from chladni.modal.operational.harmonics import machine_harmonics as machine_harmonics
    from chladni.modal.operational.setups import merge_setups as merge_setups
    from chladni.modal.operational.subspace import CovarianceDrivenSubspace as CovarianceDrivenSubspace
    from chladni.modal.shapes.joint_treatment import best_joint as best_joint
    from chladni.modal.shapes.joint_treatment import treatments as treatments
    from chladni.modal.shapes.mac import mac as mac
    from chladni.modal.shapes.relative_motion import relative_motion as relative_motion
    from chladni.modal.shapes.shape_transmissibility import shape_transmissibility as shape_transmissibility
    from chladni.modal.shapes.validation import validate as validate
    from chladni.models.analysis.damper_placement import Damper as Damper
    from chladni.models.analysis.damper_placement import place_damper as place_damper
    from chladni.models.analysis.influence import influence as influence
    from chladni.models.analysis.optimise import optimise as optimise
    from chladni.models.analysis.wish import Wish as Wish
    from chladni.models.core.model import Model as Model
    from chladni.models.core.parameter import Parameter as Parameter
    from chladni.models.core.parameter import Parameters as Parameters
    from chladni.models.core.port import Port as Port
    from chladni.models.core.port import Terminal as Terminal
    from chladni.models.core.reading import InfluenceTable as InfluenceTable
    from chladni.models.core.simulation import Simulation as Simulation
    from chladni.models.drives.catalogue import DRIVES as DRIVES
    from chladni.models.drives.drive_model import drive_model as drive_model
    from chladni.models.drives.mr_damper import mr_damper_at as mr_damper_at
    from chladni.models.drives.mr_damper_fit import fit_mr_damper as fit_mr_damper
    from chladni.models.drives.mr_record import mr_record as mr_record
    from chladni.models.effects.attached_effect import attached as attached
    from chladni.models.effects.attaching import LawAtPort as LawAtPort
    from chladni.models.effects.catalogue import CATALOGUE
    from chladni.models.effects.clues import Clues as Clues
    from chladni.models.effects.effect_kind import EffectKind as EffectKind
    from chladni.models.effects.effect_kind import Variant as Variant
    from chladni.models.elements.catalogue import ELEMENTS as ELEMENTS
    from chladni.models.excitations.multisine import Multisine as Multisine
    from chladni.models.excitations.random_noise import RandomNoise as RandomNoise
    from chladni.models.files.model_file import load_model as load_model
    from chladni.models.files.model_file import write_model as write_model
    from chladni.models.instruments.catalogue import INSTRUMENTS as INSTRUMENTS
    from chladni.models.instruments.robot_arm import arm_model as arm_model
    from chladni.models.integrator.known_motion import force_along_motion as force_along_motion
    from chladni.models.integrator.simulate import simulate as simulate
    from chladni.models.schemes.block import Block as Block
    from chladni.models.schemes.block import element_block as element_block
    from chladni.models.schemes.scheme_model import SchemeModel as SchemeModel
    from chladni.models.schemes.scheme_output import SchemeOutput as SchemeOutput
    from chladni.models.simulators.callable_simulator import callable_simulator as callable_simulator
    from chladni.models.simulators.mujoco_simulator import MujocoSimulator as MujocoSimulator
    from chladni.models.simulators.mujoco_simulator import mujoco_simulator as mujoco_simulator
    from chladni.models.structures.robot_arm import robot_arm as robot_arm
    from chladni.models.structures.structure_input import StructureInput as StructureInput
    from chladni.models.structures.structure_model import StructureModel as StructureModel
    from chladni.models.structures.structure_output import StructureOutput as StructureOutput
    from chladni.robots.excite import excite as excite
    from chladni.robots.joint_log import joint_log as joint_log
    from chladni.robots.loading import load_robot as load_robot
    from chladni.robots.trajectory import write_trajectory as write_trajectory
    from chladni.signals.cepstrum import Cepstrum as Cepstrum
    from chladni.signals.channel import Channel as Channel
    from chladni.signals.coherence import Coherence as Coherence
    from chladni.signals.cross_correlation import CrossCorrelation as CrossCorrelation
    from chladni.signals.cross_correlation import TimeDelays as TimeDelays
    from chladni.signals.cross_spectra import CrossSpectra as CrossSpectra
    from chladni.signals.deflection_shapes import DeflectionShapes as DeflectionShapes
    from chladni.signals.envelope import EnvelopeSpectrum as EnvelopeSpectrum
    from chladni.signals.envelope import Kurtogram as Kurtogram
    from chladni.signals.errors import ChladniError as ChladniError
    from chladni.signals.errors import EstimateError as EstimateError
    from chladni.signals.errors import LogError as LogError
    from chladni.signals.errors import ModelError as ModelError
    from chladni.signals.errors import SetupError as SetupError
    from chladni.signals.filtered_series import FilteredSeries as FilteredSeries
    from chladni.signals.frequency_response import FrequencyResponse as FrequencyResponse
    from chladni.signals.geometry import Geometry as Geometry
    from chladni.signals.levels import BandLevels as BandLevels
    from chladni.signals.levels import Levels as Levels
    from chladni.signals.levels import OctaveLevels as OctaveLevels
    from chladni.signals.levels import Severity as Severity
    from chladni.signals.modal_assurance import ModalAssurance as ModalAssurance
    from chladni.signals.mode_set import ModeSet as ModeSet
    from chladni.signals.order_spectra import OrderCuts as OrderCuts
    from chladni.signals.order_spectra import OrderMap as OrderMap
    from chladni.signals.peak import Peak as Peak
    from chladni.signals.power_spectral_density import PowerSpectralDensity as PowerSpectralDensity
    from chladni.signals.provenance import Provenance as Provenance
    from chladni.signals.random_vibration import ProbabilityDensity as ProbabilityDensity
    from chladni.signals.random_vibration import ProfileCheck as ProfileCheck
    from chladni.signals.random_vibration import RandomProfile as RandomProfile
    from chladni.signals.random_vibration import VibrationResponse as VibrationResponse
    from chladni.signals.rotation import Rotation as Rotation
    from chladni.signals.shock_response import ShockResponse as ShockResponse
    from chladni.signals.sine_vibration import SineCheck as SineCheck
    from chladni.signals.sine_vibration import SineProfile as SineProfile
    from chladni.signals.stabilisation_diagram import StabilisationDiagram as StabilisationDiagram
    from chladni.signals.study import Study as Study
    from chladni.signals.time_series import TimeSeries as TimeSeries
    from chladni.signals.waterfall import Waterfall as Waterfall
    from chladni.spectral.accumulator import CrossSpectraAccumulator as CrossSpectraAccumulator
    from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum as AmplitudeSpectrum
    from chladni.spectral.amplitude_spectrum import amplitude_spectrum as amplitude_spectrum
    from chladni.spectral.bands import band_rms as band_rms
    from chladni.spectral.bearings import Bearing as Bearing
    from chladni.spectral.cepstrum import cepstrum as cepstrum
    from chladni.spectral.coherence import coherence as coherence
    from chladni.spectral.coherence import partial_coherence as partial_coherence
    from chladni.spectral.cross_correlation import cross_correlation as cross_correlation
    from chladni.spectral.cross_spectra import cross_spectra as cross_spectra
    from chladni.spectral.envelope import envelope as envelope
    from chladni.spectral.filters import bandpass as bandpass
    from chladni.spectral.filters import bandstop as bandstop
    from chladni.spectral.filters import highpass as highpass
    from chladni.spectral.filters import lowpass as lowpass
    from chladni.spectral.forms import convert_form as convert_form
    from chladni.spectral.impact import find_impacts as find_impacts
    from chladni.spectral.impact import impact_cross_spectra as impact_cross_spectra
    from chladni.spectral.integration import differentiate as differentiate
    from chladni.spectral.integration import differentiate_density as differentiate_density
    from chladni.spectral.integration import integrate as integrate
    from chladni.spectral.integration import integrate_density as integrate_density
    from chladni.spectral.kurtogram import kurtogram as kurtogram
    from chladni.spectral.levels import levels as levels
    from chladni.spectral.miles import vibration_response as vibration_response
    from chladni.spectral.octaves import octaves as octaves
    from chladni.spectral.ods import deflection_shapes as deflection_shapes
    from chladni.spectral.orders import order_cuts as order_cuts
    from chladni.spectral.orders import order_map as order_map
    from chladni.spectral.peaks import find_peaks as find_peaks
    from chladni.spectral.peaks import find_response_peaks as find_response_peaks
    from chladni.spectral.probability_density import probability_density as probability_density
    from chladni.spectral.random_vibration import check_profile as check_profile
    from chladni.spectral.random_vibration import random_profile as random_profile
    from chladni.spectral.rotation import rotation as rotation
    from chladni.spectral.severity import severity as severity
    from chladni.spectral.sine_vibration import check_sine as check_sine
    from chladni.spectral.sine_vibration import sine_limits as sine_limits
    from chladni.spectral.sine_vibration import sine_profile as sine_profile
    from chladni.spectral.srs import srs as srs
    from chladni.spectral.time_delay import time_delay as time_delay
    from chladni.spectral.transmissibility import transmissibility as transmissibility
    from chladni.spectral.transmissibility import transmissibility_along as transmissibility_along
    from chladni.spectral.waterfall import waterfall as waterfall
    from chladni.spectral.zoom import zoom_spectrum as zoom_spectrum
    from chladni.viewers.figures.album import Album as Album
    from chladni.viewers.figures.saving import save_figures as save_figures

    EFFECTS = CATALOGUE
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
