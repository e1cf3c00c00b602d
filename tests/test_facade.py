import importlib
import subprocess
import sys

import pytest

import chladni

SURFACE = {
    "Bearing", "Cepstrum", "Channel", "ChladniError", "CircleFit", "Coherence", "CovarianceDrivenSubspace",
    "CrossSpectra", "EnhancedFrequencyDomainDecomposition", "EnvelopeSpectrum", "EstimateError",
    "FrequencyDomainDecomposition", "FrequencyResponse", "HalfPower", "Kurtogram", "Levels", "LogError",
    "ModalAssurance", "ModeSet", "ModelError", "OctaveLevels", "PolyReferenceLeastSquares",
    "PowerSpectralDensity", "SetupError", "Severity", "Study", "TimeSeries", "Wish", "analyse", "attached",
    "cepstrum", "coherence", "cross_spectra", "diagnose_gap", "envelope", "excite", "find_peaks",
    "find_response_peaks", "frf", "identify_modes", "influence", "kurtogram", "levels", "load_model",
    "load_robot", "load_setup", "locate_from_levels", "mac", "octaves", "open", "open_log", "optimise", "plot",
    "psd", "relative_motion", "severity", "show", "simulate", "validate", "waterfall", "write_mcap",
    "write_model",
}  # fmt: skip
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
    assert found.__name__ == name
    assert getattr(importlib.import_module(found.__module__), name) is found


def test_an_unknown_name_is_refused_as_by_any_module() -> None:
    with pytest.raises(AttributeError, match="'chladni' has no attribute 'fft'"):
        _ = chladni.fft


def test_importing_chladni_imports_nothing_heavy() -> None:
    assert not modules_after("import chladni") & HEAVY


def test_the_command_line_imports_nothing_heavy_before_a_command_runs() -> None:
    assert not modules_after("import chladni.cli.main") & (HEAVY - {"pydantic"})
