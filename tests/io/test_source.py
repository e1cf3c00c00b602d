"""Every verb on samples takes a log, its path, a series, and an array with its sample rate, and answers the same."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import chladni
from chladni.io import source
from chladni.io.source import blocks_of, density_of, response_of, series_of
from chladni.signals.testing import assert_close

RATE_HZ = 500.0
MODE_HZ = 60.0
SHAFT = chladni.Rotation(
    time_s=np.array([0.0, 20.0]), revolutions=np.array([0.0, 400.0]), start_time_ns=0, source="speed"
)
VERBS = {
    "psd": chladni.psd,
    "cross_spectra": chladni.cross_spectra,
    "waterfall": chladni.waterfall,
    "amplitude_spectrum": chladni.amplitude_spectrum,
    "coherence": partial(chladni.coherence, references="x"),
    "frf": partial(chladni.frf, references="x"),
    "identify_modes": partial(chladni.identify_modes, references="x"),
    "lowpass": partial(chladni.lowpass, high_hz=50.0),
    "highpass": partial(chladni.highpass, low_hz=50.0),
    "bandpass": partial(chladni.bandpass, band_hz=(20.0, 50.0)),
    "bandstop": partial(chladni.bandstop, band_hz=(20.0, 50.0)),
    "srs": chladni.srs,
    "rotation": partial(chladni.rotation, ridge="y"),
    "order_map": partial(chladni.order_map, rotation=SHAFT),
    "order_cuts": partial(chladni.order_cuts, rotation=SHAFT),
    "deflection_shapes": partial(chladni.deflection_shapes, references="x", frequencies_hz=[MODE_HZ]),
    "transmissibility": partial(chladni.transmissibility, references="x"),
    "cross_correlation": partial(chladni.cross_correlation, references="x"),
    "time_delay": partial(chladni.time_delay, references="x"),
    "zoom_spectrum": partial(chladni.zoom_spectrum, band_hz=(50.0, 70.0)),
    "probability_density": chladni.probability_density,
    "levels": chladni.levels,
    "cepstrum": chladni.cepstrum,
    "kurtogram": chladni.kurtogram,
}
# Motions alone, densities too, or a value for each channel.
OF_THEIR_KIND = {
    "integrate": partial(chladni.integrate, low_hz=5.0),
    "differentiate": partial(chladni.differentiate, high_hz=50.0),
    "octaves": chladni.octaves,
    "envelope": partial(chladni.envelope, band_hz=(50.0, 70.0)),
}


def arrays():
    """Noise as a force, and the answer of one mode with 2 % damping, by its impulse response."""
    rng = np.random.default_rng(3)
    force = rng.standard_normal(8192)
    time_s, omega = np.arange(400) / RATE_HZ, 2 * np.pi * MODE_HZ
    impulse = np.exp(-0.02 * omega * time_s) * np.sin(omega * np.sqrt(1 - 0.02**2) * time_s)
    tip = np.convolve(force, impulse)[: force.size] + 0.01 * rng.standard_normal(force.size)
    return {"x": force, "y": tip}


def series():
    return chladni.TimeSeries.from_arrays(arrays(), sample_rate_hz=RATE_HZ)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    name = tmp_path_factory.mktemp("source") / "test.csv"
    rows = np.column_stack(list(arrays().values()))
    np.savetxt(name, rows, delimiter=",", header="x,y", comments="", fmt="%.17g")
    return name


@pytest.mark.parametrize("verb", VERBS.values(), ids=VERBS)
def test_arrays_a_path_its_text_its_log_and_a_series_give_the_same(verb, path):
    expected = verb(series())
    with chladni.open(path, sample_rate_hz=RATE_HZ) as log:
        found = [verb(log), *(verb(given, sample_rate_hz=RATE_HZ) for given in (arrays(), path, str(path)))]
    for one in found:
        assert_close(one, expected, rtol=1e-12)


@pytest.mark.parametrize("verb", VERBS.values(), ids=VERBS)
def test_an_array_without_rate_is_refused_and_a_series_with_one_too(verb):
    with pytest.raises(chladni.SetupError, match="give sample_rate_hz="):
        verb(arrays())
    with pytest.raises(chladni.SetupError, match="so leave it out"):
        verb(series(), sample_rate_hz=RATE_HZ)


@pytest.mark.parametrize("verb", VERBS.values(), ids=VERBS)
def test_what_holds_no_samples_is_refused_by_its_name(verb):
    with pytest.raises(chladni.SetupError, match="a PowerSpectralDensity holds no samples over time"):
        verb(chladni.psd(series()))


@pytest.mark.parametrize("verb", [*VERBS.values(), *OF_THEIR_KIND.values()], ids=[*VERBS, *OF_THEIR_KIND])
def test_a_series_without_channels_is_refused(verb):
    nothing = replace(series(), values=np.empty((0, 8192)), channels=())
    with pytest.raises(chladni.EstimateError, match="no channel"):
        verb(nothing)


def test_blocks_without_channels_are_refused():
    nothing = replace(series(), values=np.empty((0, 8192)), channels=())
    with pytest.raises(chladni.EstimateError, match="holds no channel"):
        chladni.cross_spectra(iter([nothing]))


def test_part_of_an_array_is_that_part_of_its_series():
    part = series_of(arrays(), sample_rate_hz=RATE_HZ, channels="y", start_s=1.0, end_s=3.0)
    assert_close(part, series().select(["y"]).window(start_s=1.0, end_s=3.0), rtol=0)
    found = chladni.cross_spectra(arrays(), sample_rate_hz=RATE_HZ, channels="y", start_s=1.0, end_s=3.0)
    assert_close(found, chladni.cross_spectra(part), rtol=0)


def test_a_large_log_is_averaged_block_by_block(path, monkeypatch):
    monkeypatch.setattr(source, "IN_MEMORY_BYTES", 0)
    monkeypatch.setattr(source, "VALUES_IN_A_BLOCK", 1)
    with chladni.open(path, sample_rate_hz=RATE_HZ) as log:
        blocks = list(blocks_of(log, channels=["x"]))
        found = chladni.cross_spectra(log, resolution_hz=2.0)
    assert len(blocks) > 8
    assert_close(found, chladni.cross_spectra(series(), resolution_hz=2.0), rtol=1e-12)


def test_blocks_stay_blocks_and_take_no_choice():
    halves = [series().window(end_s=8.192), series().window(start_s=8.192)]
    for given in (halves, iter(halves), tuple(halves)):
        assert_close(
            chladni.cross_spectra(given, resolution_hz=2.0),
            chladni.cross_spectra(series(), resolution_hz=2.0),
            rtol=1e-12,
        )
    with pytest.raises(chladni.SetupError, match="choose channels and times where they are made"):
        chladni.cross_spectra(halves, channels="y")


def test_modes_are_found_from_an_array_of_frequency_responses():
    response = chladni.frf(series(), references="x", resolution_hz=0.5)
    modes = chladni.identify_modes(response.values, frequency_hz=response.frequency_hz)
    (found_hz,), (damping,) = modes.frequency_hz, modes.damping_ratio
    # Truth by construction; nothing is known of the error of an array, so that 1 % is asked for.
    assert abs(found_hz / MODE_HZ - 1) < 0.01
    assert abs(damping / 0.02 - 1) < 0.1


def test_spectra_of_arrays_need_frequencies_and_spectra_take_none():
    lines = np.arange(1.0, 9.0)
    for make, array in ((response_of, lines + 0j), (density_of, lines)):
        with pytest.raises(chladni.SetupError, match="give frequency_hz="):
            make(array)
        with pytest.raises(chladni.SetupError, match="leave them out"):
            make(make(array, frequency_hz=lines), frequency_hz=lines)
        with pytest.raises(chladni.EstimateError, match="frequency is their last axis"):
            make(array, frequency_hz=lines[1:])
        with pytest.raises(chladni.SetupError, match="str is no spectrum"):
            make("a.uff", frequency_hz=lines)


def test_a_string_means_one_channel(path):
    with chladni.open(path, sample_rate_hz=RATE_HZ) as log:
        assert_close(log.read("y"), log.read(["y"]), rtol=0)
        assert_close(chladni.psd(log, channels="y"), chladni.psd(log, channels=["y"]), rtol=0)
    assert series().select("y").channels == series().channels[1:]


def test_responses_and_references_may_be_two_arrays():
    given = arrays()
    expected = chladni.frf(series(), references="x", resolution_hz=1.0)
    found = chladni.frf(given["y"], references=given["x"], sample_rate_hz=RATE_HZ, resolution_hz=1.0)
    np.testing.assert_array_equal(found.values, expected.values)
    assert [channel.name for channel in (*found.references, *found.responses)] == ["reference1", "ch1"]
    with pytest.raises(chladni.SetupError, match="name its channel"):
        chladni.frf(series(), references=given["x"])
    with pytest.raises(chladni.EstimateError, match="references have 8191 samples, responses 8192"):
        chladni.frf(given["y"], references=given["x"][1:], sample_rate_hz=RATE_HZ)
