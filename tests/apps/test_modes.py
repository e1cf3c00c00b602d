"""Modes of logs, series, functions and spectra in one call, against the closed form."""

import numpy as np
import pytest

from chladni.apps.frf import frf
from chladni.apps.modes import identify_modes
from chladni.io.log import open_log
from chladni.modal.experimental.circle_fit import CircleFit
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.modal.operational.efdd import EnhancedFrequencyDomainDecomposition
from chladni.modal.operational.subspace import CovarianceDrivenSubspace
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from tests.arm import FORCE, TOOL, WRIST, short_arm, write_arm
from tests.modal import truth as made
from tests.modal.truth import ModalTruth, channels

# Twenty-five seconds give half a percent of the lowest mode's frequency at the default resolution.
SIGMAS = 4.0
# The force ends at 300 Hz: to responses alone its edge looks like a property of the structure.
FORCED_HZ = (5.0, 280.0)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    path = write_arm(tmp_path_factory.mktemp("arm"))
    with open_log(path, setup=path.with_name("setup.toml")) as log:
        yield log


@pytest.fixture(scope="module")
def truth():
    return short_arm().modes


def series_of_arm():
    made = short_arm()
    rows = np.concatenate([one.values[:, :19_000] for one in made.series])
    channels = tuple(one.channels[0] for one in made.series)
    return TimeSeries(values=rows, channels=channels, sample_rate_hz=1000.0)


def assert_near_truth(modes, truth, *, floor=0.0):
    """Every found mode is a true one within its own error bar (or a floor), and none is found twice."""
    nearest = np.abs(modes.frequency_hz[:, None] - truth.frequency_hz).argmin(axis=1)
    assert len(set(nearest.tolist())) == nearest.size
    allowed = np.maximum(SIGMAS * modes.frequency_std_hz, floor * modes.frequency_hz)
    assert np.all(np.abs(modes.frequency_hz - truth.frequency_hz[nearest]) < allowed)


def test_a_log_needs_no_argument_when_its_channels_tell_the_excitation(arm, truth):
    modes = identify_modes(arm)
    assert modes.frequency_hz.size == truth.frequency_hz.size
    assert_near_truth(modes, truth)
    assert [channel.name for channel in modes.references] == [FORCE]
    assert modes.scale is not None  # the tool is a driving point


def test_functions_give_what_their_log_gives(arm):
    # The lines that are asked for are the lines that modes are identified from.
    response = frf(arm, references=FORCE, resolution_hz=0.5)
    np.testing.assert_allclose(
        identify_modes(response).frequency_hz,
        identify_modes(arm, references=FORCE, resolution_hz=0.5).frequency_hz,
        rtol=1e-12,
    )


@pytest.mark.nightly
def test_modes_are_given_finer_lines_than_a_spectrum_for_the_eye(arm):
    modes = identify_modes(arm, references=FORCE)
    assert modes.provenance.segment_s > 1.9 * frf(arm, references=FORCE).provenance.segment_s


def test_a_series_gives_modes_from_functions_and_from_responses_alone(truth):
    series = series_of_arm()
    assert_near_truth(identify_modes(series, references=FORCE), truth)
    # The arm is shaken by noise of one band, at one body: nearly what responses alone ask for.
    operational = identify_modes(series, operational=True, band_hz=FORCED_HZ)
    assert operational.references == ()
    assert operational.frequency_hz.size >= 3
    assert_near_truth(operational, truth, floor=0.01)


def test_bands_are_fitted_one_by_one_and_joined(arm, truth):
    modes = identify_modes(arm, references=FORCE, band_hz=[(15, 57), (57, 130)])
    assert modes.frequency_hz.size == 4
    # The border runs between two heavily damped modes: what crosses it is a residual only to first order.
    assert_near_truth(modes, truth, floor=0.01)


@pytest.mark.nightly
@pytest.mark.slow
def test_one_band_and_a_count_and_given_frequencies_limit_what_is_found(arm, truth):
    within = identify_modes(arm, references=FORCE, band_hz=(15, 57))
    assert within.frequency_hz.size == 2
    assert identify_modes(arm, references=FORCE, count=2).frequency_hz.size == 2
    (near,) = identify_modes(arm, references=FORCE, frequencies_hz=[48.2]).frequency_hz
    assert near == pytest.approx(truth.frequency_hz[1], rel=0.005)


def test_named_responses_only(arm):
    modes = identify_modes(arm, references=FORCE, responses=[TOOL, WRIST])
    assert [channel.name for channel in modes.channels] == [TOOL, WRIST]


@pytest.mark.nightly
@pytest.mark.parametrize("method", [CircleFit(), PolyReferenceLeastSquares(max_order=30)])
def test_methods_for_functions(arm, truth, method):
    modes = identify_modes(arm, references=FORCE, method=method)
    assert modes.frequency_hz.size >= 3
    assert_near_truth(modes, truth, floor=0.005)


@pytest.mark.parametrize("method", [CovarianceDrivenSubspace(), EnhancedFrequencyDomainDecomposition()])
def test_methods_for_responses_alone_need_no_word_operational(truth, method):
    modes = identify_modes(series_of_arm(), method=method, band_hz=FORCED_HZ)
    assert modes.frequency_hz.size >= 2
    assert_near_truth(modes, truth, floor=0.02)


def test_cross_spectra_give_modes(truth):
    series = series_of_arm()
    responses = series.select([channel.name for channel in series.channels if channel.name != FORCE])
    modes = identify_modes(cross_spectra(responses, resolution_hz=0.5), band_hz=FORCED_HZ)
    assert modes.frequency_hz.size >= 2
    assert_near_truth(modes, truth, floor=0.02)


@pytest.mark.parametrize(
    ("source", "method", "words"),
    [
        ("response", CovarianceDrivenSubspace(), "works on responses alone"),
        ("spectra", CovarianceDrivenSubspace(), "doesn't work on cross-spectra"),
        ("spectra", CircleFit(), "doesn't work on cross-spectra"),
    ],
)
def test_a_method_that_does_not_fit_the_source_is_refused(source, method, words):
    series = series_of_arm()
    found = frf(series, references=FORCE) if source == "response" else cross_spectra(series)
    with pytest.raises(EstimateError, match=words):
        identify_modes(found, method=method)


def test_a_method_for_functions_does_not_work_on_responses_alone():
    with pytest.raises(EstimateError, match="needs frequency responses"):
        identify_modes(series_of_arm(), operational=True, method=CircleFit())


@pytest.mark.parametrize("band", [(1, 2, 3), [[[1, 2]]], 5.0])
def test_a_band_is_two_numbers(band):
    with pytest.raises(EstimateError, match="must be"):
        identify_modes(series_of_arm(), references=FORCE, band_hz=band)


def test_responses_alone_are_identified_in_one_band():
    with pytest.raises(EstimateError, match="in one band"):
        identify_modes(series_of_arm(), operational=True, band_hz=[(10, 40), (40, 80)])


def test_a_hammer_drives_modes_as_far_as_its_force_stays_within_20_db():
    rate_hz, samples, hits = 2048, 8192, 5
    # A half sine of 6 samples is 20 dB down at 444 Hz, and has a side lobe 23 dB down around 640 Hz.
    end_hz = 444.0
    made = ModalTruth(
        frequency_hz=np.array([90.0, 300.0, 640.0]),
        damping_ratio=np.full(3, 0.005),
        shapes=np.array([[1.0, 0.5], [0.8, -1.0], [-0.6, 1.0]]),
    )
    force = np.zeros((1, 4 * hits * samples))
    for hit in range(hits):
        first = hit * samples + 200
        force[0, first : first + 6] = 100 * np.sin(np.pi * (np.arange(6) + 0.5) / 6)
    values = np.concatenate([force, made.respond(force, (0,), rate_hz)])[:, : hits * samples]
    values += 1e-4 * np.random.default_rng(1).standard_normal(values.shape)
    forces, motions = channels(2, (0,))
    series = TimeSeries(values=values, sample_rate_hz=rate_hz, channels=(*forces, *motions))
    driven = identify_modes(series)
    assert driven.provenance.averaging == "impact"
    np.testing.assert_allclose(driven.frequency_hz, made.frequency_hz[made.frequency_hz < end_hz], rtol=1e-4)
    (told,) = [note for note in driven.provenance.notes if "20 dB down" in note]
    assert float(told.split(" Hz")[0].split()[-1]) == pytest.approx(end_hz, rel=0.02)
    for wanted in ({"band_hz": (20.0, 800.0)}, {"frequencies_hz": made.frequency_hz.tolist()}):
        further = identify_modes(series, **wanted)
        np.testing.assert_allclose(further.frequency_hz, made.frequency_hz, rtol=1e-4)
        assert not any("20 dB down" in note for note in further.provenance.notes)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_motion_as_reference_holds_its_point_still(arm, truth):
    def warnings(modes):
        return [note for note in modes.provenance.notes if "held still there" in note]

    (warning,) = warnings(identify_modes(arm, references=TOOL, band_hz=FORCED_HZ))
    assert TOOL in warning
    assert not warnings(identify_modes(arm))


@pytest.mark.nightly
@pytest.mark.slow
def test_modes_that_nobody_asked_for_are_no_misfit(arm):
    everything, first = identify_modes(arm), identify_modes(arm, count=1)
    assert first.frequency_hz.size == 1
    assert first.fit.error == pytest.approx(everything.fit.error, rel=1e-9)


@pytest.mark.nightly
def test_an_excitation_that_was_not_measured_does_not_hide_heavily_damped_modes():
    # Half of the motion is due to the force at the other end: single fine lines are nothing but noise.
    model = made.chain(damping=0.06)
    series = made.record(model, cycles=1500, rng=np.random.default_rng(1), noise=0.01, at=(0, 4))
    known = [channel.name for channel in series.channels if channel.name != made.FORCE.format(4)]
    modes = identify_modes(series.select(known), references=made.FORCE.format(0))
    assert modes.frequency_hz.size >= 4
    assert_near_truth(modes, model)
