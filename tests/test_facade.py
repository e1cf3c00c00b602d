import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import chladni

SURFACE = {
    "Album", "AmplitudeSpectrum", "BandLevels", "Bearing", "Block", "Cepstrum", "Channel", "ChladniError",
    "CircleFit", "Clues", "Coherence", "CovarianceDrivenSubspace", "CrossCorrelation", "CrossSpectra",
    "CrossSpectraAccumulator", "DRIVES", "Damper", "DeflectionShape", "DeflectionShapes", "Diagnosis",
    "EFFECTS", "ELEMENTS", "EffectKind", "EnhancedFrequencyDomainDecomposition", "EnvelopeSpectrum",
    "EstimateError", "FilteredSeries", "FrequencyDomainDecomposition", "FrequencyResponse", "Geometry",
    "HalfPower", "INSTRUMENTS", "InfluenceTable", "Kurtogram", "LawAtPort", "LevelLocation", "Levels", "Log",
    "LogError", "Measurement", "ModalAssurance", "ModePicking", "ModeSet", "Model", "ModelError",
    "MujocoSimulator", "Multisine", "OctaveLevels", "OrderCuts", "OrderMap", "Parameter", "Parameters", "Peak",
    "PolyReferenceLeastSquares", "Port", "PowerSpectralDensity", "ProbabilityDensity", "ProfileCheck",
    "Provenance", "RandomNoise", "RandomProfile", "Rotation", "SchemeModel", "SchemeOutput", "SetupError",
    "Severity", "ShockResponse", "Simulation", "SineCheck", "SineProfile", "StabilisationDiagram",
    "StructureInput", "StructureModel", "StructureOutput", "Study", "StudyResults", "Terminal", "TimeDelays",
    "TimeSeries", "Variant", "VibrationResponse", "Waterfall", "Wish", "amplitude_spectrum", "analyse",
    "arm_model", "attached", "band_rms", "bandpass", "bandstop", "best_joint", "callable_simulator", "cepstrum",
    "check_driving_point", "check_linearity", "check_profile", "check_reciprocity", "check_sine", "coherence",
    "compare_levels", "convert_form", "cross_correlation", "cross_spectra", "deflection_shape",
    "deflection_shapes", "diagnose_gap", "diagnose_simulator", "differentiate", "differentiate_density",
    "drive_model", "element_block", "envelope", "excite", "explained_model", "explained_simulator",
    "find_impacts", "find_peaks", "find_response_peaks", "fit_mr_damper", "force_along_motion", "frf",
    "highpass", "identify_modes", "impact_cross_spectra", "influence", "integrate", "integrate_density",
    "join_references", "joint_log", "kurtogram", "levels", "live", "load_model", "load_robot", "load_setup",
    "locate_from_levels", "lowpass", "mac", "machine_harmonics", "make_demo_log", "merge_setups",
    "mr_damper_at", "mr_record", "mujoco_simulator", "notebook", "octaves", "open", "open_log", "optimise",
    "order_cuts", "order_map", "partial_coherence", "phase_referenced_shape", "pick_modes", "place_damper",
    "plot", "probability_density", "psd", "random_profile", "read_uff_modes", "relative_motion", "results",
    "robot_arm", "rotation", "roving_hammer", "save_figures", "severity", "shape_transmissibility", "show",
    "simulate", "sine_limits", "sine_profile", "srs", "time_delay", "transmissibility",
    "transmissibility_along", "treatments", "tuned_model", "unit_modal_mass_shapes", "validate",
    "vibration_response", "waterfall", "write_mcap", "write_model", "write_report", "write_trajectory",
    "write_uff", "write_uff_modes", "zoom_spectrum",
}  # fmt: skip
ARGUMENTS = Path(__file__).parents[1] / "docs" / "arguments.md"
HEAD = (
    "# Arguments of the verbs", "",
    "One word for one thing, whichever verb takes it. This table is made from the signatures.", "",
    "| argument | verbs |", "| --- | --- |",
)  # fmt: skip
HEAVY = {"numpy", "scipy", "rerun", "matplotlib", "pint", "pydantic", "mcap", "zstandard", "numba", "panel", "bokeh"}


def modules_after(statement: str) -> set[str]:
    code = f"import sys\n{statement}\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    finished = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return set(finished.stdout.split())


def test_the_public_surface_is_the_one_that_was_agreed() -> None:
    assert set(chladni.__all__) == SURFACE
    assert set(dir(chladni)) == SURFACE | {"__version__"}


@pytest.mark.parametrize("name", sorted(SURFACE))
def test_each_public_name_comes_from_the_module_that_defines_it(name: str) -> None:
    found = getattr(chladni, name)
    # Tables have no name of their own.
    if not name.isupper():
        assert found.__name__ == name
        assert getattr(importlib.import_module(found.__module__), name) is found


# Verbs in a file that is named for what all of its verbs do, or for the field's own word.
OF_A_KIND = {
    "filters": {"bandpass", "bandstop", "highpass", "lowpass"},
    "integration": {"differentiate", "differentiate_density", "integrate", "integrate_density"},
    "bench": {"notebook"}, "picking": {"pick_modes"}, "show": {"write_report"}, "saving": {"save_figures"},
    "log": {"open"}, "writer": {"write_mcap"}, "loading": {"load_robot"}, "validation": {"validate"},
    "roving": {"join_references"}, "scaling": {"unit_modal_mass_shapes"}, "ods": {"deflection_shapes"},
    "random_vibration": {"check_profile"}, "miles": {"vibration_response"},
}  # fmt: skip


def words_of(name: str) -> set[str]:
    return {word.removesuffix("s") for word in name.split("_")}


@pytest.mark.parametrize("verb", [name for name in sorted(SURFACE) if name.islower()])
def test_the_file_that_holds_a_verb_bears_its_name(verb: str) -> None:
    stem = getattr(chladni, verb).__module__.rpartition(".")[2]
    assert words_of(stem) & words_of(verb) or verb in OF_A_KIND.get(stem, set())


# What an argument is never called, since another word is used for it everywhere.
SYNONYMS = {
    "reference": "references", "response": "responses", "channel": "channels", "names": "channels",
    "paths": "channels", "rate_hz": "sample_rate_hz", "fs": "sample_rate_hz", "seconds": "duration_s",
    "length_s": "duration_s", "band": "band_hz", "begin_s": "start_s", "stop_s": "end_s",
}  # fmt: skip
# Singular on purpose: the one point that all phases or ratios refer to, and the one value that is written.
MEANT = {
    "reference": {"deflection_shape", "phase_referenced_shape"},
    "response": {"write_uff_modes"},
}  # fmt: skip


def arguments(*kinds: inspect._ParameterKind) -> dict[str, list[str]]:
    """Arguments of every public verb, and the verbs that take each."""
    table: dict[str, list[str]] = {}
    for verb in chladni.__all__:
        if inspect.isfunction(getattr(chladni, verb)):
            for argument in inspect.signature(getattr(chladni, verb)).parameters.values():
                if argument.kind in kinds:
                    table.setdefault(argument.name, []).append(verb)
    return table


def arguments_page() -> str:
    """Give docs/arguments.md."""
    table = sorted(arguments(*inspect._ParameterKind).items())
    rows = [f"| `{name}` | {', '.join(f'`{verb}`' for verb in sorted(verbs))} |" for name, verbs in table]
    return "\n".join([*HEAD, *rows, ""])


def test_one_thing_has_one_name_across_all_verbs() -> None:
    # What comes first is data, and may be called by what it is.
    for argument, verbs in arguments(inspect.Parameter.KEYWORD_ONLY).items():
        strange = set(verbs) - MEANT.get(argument, set())
        assert argument not in SYNONYMS or not strange, f"{strange}: {argument} is {SYNONYMS.get(argument)}"


def test_the_table_of_arguments_is_that_of_the_signatures() -> None:
    """`python -m tests.test_facade` writes it."""
    assert ARGUMENTS.read_text(encoding="utf-8") == arguments_page()


@pytest.mark.parametrize(
    ("verb", "old", "new"),
    [
        ("frf", "reference", "references"),
        ("frf", "response", "responses"),
        ("identify_modes", "reference", "references"),
        ("identify_modes", "channels", "responses"),
        ("simulate", "rate_hz", "sample_rate_hz"),
        ("simulate", "seconds", "duration_s"),
        ("excite", "length_s", "duration_s"),
        ("excite", "rate_hz", "sample_rate_hz"),
        ("influence", "band", "settling_band"),
        ("find_peaks", "density", "source"),
        ("find_response_peaks", "response", "source"),
        ("analyse", "log", "source"),
        ("partial_coherence", "reference", "references"),
        ("amplitude_spectrum", "spectra", "source"),
        ("diagnose_simulator", "recording", "source"),
    ],
)
def test_the_old_name_of_an_argument_works_with_a_warning(verb: str, old: str, new: str) -> None:
    # What the value then does is the verb's own; nonsense ends it before any work.
    with (
        pytest.warns(DeprecationWarning, match=f"{verb}: {old} is now {new}"),
        pytest.raises((TypeError, chladni.ChladniError)),
    ):
        getattr(chladni, verb)(**{old: object(), "no such argument": 1})
    with pytest.raises(TypeError, match=f"{old} and {new} are one argument"):
        getattr(chladni, verb)(**{old: 1, new: 1})


def test_an_unknown_name_is_refused_as_by_any_module() -> None:
    with pytest.raises(AttributeError, match="'chladni' has no attribute 'fft'"):
        _ = chladni.fft


def test_importing_chladni_imports_nothing_heavy() -> None:
    assert not modules_after("import chladni") & HEAVY


def test_the_command_line_imports_nothing_heavy_before_a_command_runs() -> None:
    assert not modules_after("import chladni.cli.main") & (HEAVY - {"pydantic"})


if __name__ == "__main__":
    ARGUMENTS.write_text(arguments_page(), encoding="utf-8")
