from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.forms import convert_form
from tests.modal import truth

CHAIN = truth.chain()
CLOSE = truth.close_modes()
FORCE = truth.FORCE.format(0)
IDENTIFY = PolyReferenceLeastSquares().identify


def chain_response(seed, *, cycles=800, noise=0.01, resolution_hz=0.02, **options):
    series = truth.record(CHAIN, cycles=cycles, rng=np.random.default_rng(seed), noise=noise, **options)
    return chladni.frf(series, references=FORCE, resolution_hz=resolution_hz)


def line_response(seed, *, at=(0,), noise=0.03, lines_hz=None, model=CHAIN):
    lines_hz = np.arange(0.02, 8.0, 0.02) if lines_hz is None else lines_hz
    return truth.noisy_response(model, lines_hz, at, noise=noise, rng=np.random.default_rng(seed))


def close_response(seed, at=(0, 1)):
    return line_response(seed, at=at, model=CLOSE, lines_hz=np.arange(9.0, 11.0, 0.01))


def sigmas(modes, model=CHAIN):
    """Errors of frequency, damping and shape in their own sigmas; the component that is 1 has none."""
    free = modes.shape_std.real > 0
    moved, std = (modes.shapes - model.unit_shapes)[free], modes.shape_std[free]
    return (
        (modes.frequency_hz - model.frequency_hz) / modes.frequency_std_hz,
        (modes.damping_ratio - model.damping_ratio) / modes.damping_std,
        np.concatenate([moved.real / std.real, moved.imag / std.imag]),
    )


@pytest.fixture(scope="module")
def found():
    return IDENTIFY(chain_response(1))


def test_chain_from_a_noisy_record(found):
    # Five sigma: one record in a thousand fails by chance in one of its ten numbers.
    frequency, damping, shape = sigmas(found)
    assert np.abs(frequency).max() < 5
    assert np.abs(damping).max() < 5
    assert np.abs(shape).max() < 5
    assert all(truth.mac(one, other) > 0.999 for one, other in zip(found.shapes, CHAIN.shapes, strict=True))
    # The error bars are worth having: 800 cycles of the first mode, more of the others.
    assert np.all(found.frequency_std_hz < 1e-3 * found.frequency_hz)
    assert np.all(found.damping_std < 0.1 * found.damping_ratio)


def test_chain_is_scaled_by_its_driving_point(found):
    assert found.scale is not None
    mass = 1 / np.abs(CHAIN.shapes).max(axis=1) ** 2
    assert np.all(np.abs(found.scale.modal_mass - mass) < 5 * found.scale.modal_mass_std)
    assert (found.scale.response, found.scale.reference) == (truth.MOTION.format(0), FORCE)


def test_the_set_carries_what_it_was_made_from(found):
    assert found.provenance.estimator == "pLSCF"
    assert found.channels[0].name == truth.MOTION.format(0)
    assert found.references[0].name == FORCE
    diagram, spread = found.stabilisation, found.spread
    assert diagram.indicator.shape == (1, diagram.indicator_hz.size)
    assert (diagram.indicator_name, diagram.indicator_unit) == ("CMIF", "(m/s^2)/N")
    for mode, frequency_hz in enumerate(found.frequency_hz):
        members = diagram.mode == mode
        assert members.sum() == spread.orders[mode] >= 3
        assert np.abs(diagram.frequency_hz[members] / frequency_hz - 1).max() < 0.02
        assert np.unique(diagram.order[members]).size == members.sum()
    assert np.all(np.abs(spread.frequency_hz / found.frequency_hz - 1) < 0.01)


def test_synthesis_is_the_measured_functions(found):
    response = chain_response(1)
    rows = np.searchsorted(response.frequency_hz, found.fit.frequency_hz)
    measured = response.values[..., rows]
    off = np.sqrt(np.sum(np.abs(measured - found.fit.synthesised) ** 2) / np.sum(np.abs(measured) ** 2))
    assert found.fit.error == pytest.approx(off)
    assert off < 0.05


@pytest.mark.parametrize("form", ["receptance", "mobility"])
def test_other_forms_give_the_same_modes(form):
    response = line_response(3)
    others = IDENTIFY(convert_form(response, form))
    modes = IDENTIFY(response)
    assert others.frequency_hz.size == 5
    # The same data with the same weights, line by line.
    np.testing.assert_allclose(others.frequency_hz, modes.frequency_hz, atol=0.2 * modes.frequency_std_hz.max())
    np.testing.assert_allclose(others.participation, modes.participation, rtol=0.02)


def test_close_modes_with_two_references():
    # Of 100 draws 95 are wanted; eight of eight come by chance with 0.95 in two cases of three.
    for seed in range(8):
        modes = IDENTIFY(close_response(seed))
        assert modes.frequency_hz.size == 2
        np.testing.assert_allclose(modes.frequency_hz, CLOSE.frequency_hz, rtol=5e-4)
        assert all(truth.mac(one, other) > 0.99 for one, other in zip(modes.shapes, CLOSE.shapes, strict=True))


def test_close_modes_with_one_reference_are_one_with_a_wider_bar_or_both():
    for seed in range(4):
        modes = IDENTIFY(close_response(seed, at=(0,)))
        assert modes.frequency_hz.size in (1, 2)
        # Either way what is said holds a true frequency within its bar, or the middle that two such modes look like.
        assert np.all(np.abs(modes.frequency_hz - 10.0) < 0.01 + 3 * modes.frequency_std_hz)


@pytest.mark.parametrize(
    ("samples", "references", "responses", "resolution_hz"),
    [(2**13, 1, 4, None), (2**12, 2, 3, None), (2**10, 1, 2, 0.2), (2**11, 1, 1, 0.1), (2**13, 1, 6, 0.02)],
)
def test_noise_has_no_modes(samples, references, responses, resolution_hz):
    # Many averages, few averages (two and a half), and many lines; a false alarm is set to one in ten thousand.
    for seed in range(5):
        rng = np.random.default_rng(seed)
        series = truth.noise_record(samples, rng=rng, references=references, responses=responses)
        names = [truth.FORCE.format(number) for number in range(references)]
        modes = IDENTIFY(chladni.frf(series, references=names, resolution_hz=resolution_hz))
        assert modes.frequency_hz.size == 0
        assert any(note.startswith("no mode:") for note in modes.provenance.notes)
        assert modes.shapes.shape == (0, responses)
        assert modes.stabilisation is not None


@pytest.mark.nightly
def test_as_much_noise_as_signal_hides_no_mode():
    for seed in range(4):
        modes = IDENTIFY(chain_response(seed, cycles=2000, noise=1.0, force_noise=0.0, resolution_hz=0.01))
        assert modes.frequency_hz.size == 5
        assert np.abs(sigmas(modes)[0]).max() < 5


def test_intervals_cover_the_truth():
    # Lines of known variance; ten runs of each number, and 95 % of 50 frequencies: 41 or more but for one in 10^4.
    inside = np.array(
        [[np.mean(np.abs(z) < 1.96) for z in sigmas(IDENTIFY(line_response(seed)))] for seed in range(10)]
    )
    assert np.all(inside.mean(axis=0) > 0.82)
    # Bars that are twice too wide would hold all of the 360 shape components.
    assert inside[:, 2].mean() < 0.995


def test_fewer_modes_than_there_are_are_the_most_significant():
    response = line_response(2)
    three = IDENTIFY(response, count=3)
    whole = IDENTIFY(response)
    assert three.frequency_hz.size == 3
    assert set(three.frequency_hz.round(9)) <= set(whole.frequency_hz.round(9))
    assert three.participation.shape == (3, 1)
    assert three.stabilisation.mode.max() == 2


def test_more_modes_than_there_are_get_fewer_with_the_reason():
    modes = IDENTIFY(line_response(2), count=9)
    assert modes.frequency_hz.size == 5
    assert any("9 modes asked for, but the data need no more than 5" in n for n in modes.provenance.notes)


def test_frequencies_asked_for():
    modes = IDENTIFY(line_response(2), frequencies_hz=[4.61, 1.0, 3.5])
    np.testing.assert_allclose(modes.frequency_hz, CHAIN.frequency_hz[[0, 2]], rtol=1e-3)
    assert any("no pole within" in note and "3.5 Hz" in note for note in modes.provenance.notes)
    # The others are in the fit all the same, or these would be off.
    assert np.abs((modes.damping_ratio - 0.01) / modes.damping_std).max() < 5


def test_band():
    modes = IDENTIFY(line_response(2), band_hz=(2.0, 5.0))
    np.testing.assert_allclose(modes.frequency_hz, CHAIN.frequency_hz[1:3], rtol=1e-3)
    assert (modes.fit.frequency_hz[0] >= 2.0, modes.fit.frequency_hz[-1] <= 5.0) == (True, True)


def test_lines_that_are_not_excited_or_not_finite_do_not_count():
    response = line_response(2)
    values, excited = response.values.copy(), response.excited.copy()
    values[..., 40:44] = np.nan
    values[2, 0, 100] = np.inf
    excited[300:] = False
    values[..., 300:] = 1e9
    modes = IDENTIFY(replace(response, values=values, excited=excited))
    np.testing.assert_allclose(modes.frequency_hz, CHAIN.frequency_hz[:4], rtol=1e-3)


def test_functions_without_sigma_still_give_modes():
    response = line_response(2)
    modes = IDENTIFY(replace(response, std=np.full(response.std.shape, np.inf)))
    np.testing.assert_allclose(modes.frequency_hz, CHAIN.frequency_hz, rtol=2e-3)
    assert np.all(np.isfinite(modes.frequency_std_hz))


def test_responses_without_a_unit_are_taken_as_accelerations_and_it_is_said():
    response = line_response(2)
    plain = replace(response, responses=tuple(replace(channel, unit="1") for channel in response.responses))
    modes = IDENTIFY(plain)
    assert modes.frequency_hz.size == 5
    assert modes.channels[0].unit == "1"
    assert any("taken as accelerations" in note for note in modes.provenance.notes)


def test_damping_of_an_exponential_window_is_taken_off():
    decay_per_s = 0.02
    response = line_response(2)
    plain = IDENTIFY(response)
    windowed = replace(response, provenance=replace(response.provenance, window_decay_per_s=decay_per_s))
    corrected = IDENTIFY(windowed)
    np.testing.assert_allclose(corrected.poles.real, plain.poles.real + decay_per_s, rtol=1e-9)


def test_a_misfit_is_told():
    response = line_response(2)
    modes = IDENTIFY(replace(response, std=response.std / 20))
    assert modes.frequency_hz.size == 5
    assert any("chi-square is" in note for note in modes.provenance.notes)


def test_coarse_lines_are_told():
    response = line_response(2, lines_hz=np.arange(0.05, 8.0, 0.05))
    notes = IDENTIFY(response).provenance.notes
    assert any("less than 2 lines wide" in note for note in notes)


def test_max_order_is_a_parameter():
    modes = PolyReferenceLeastSquares(max_order=16).identify(line_response(2))
    assert modes.stabilisation.order.max() == 16
    assert modes.frequency_hz.size == 5


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"count": 0}, "count 0 must be at least 1"),
        ({"frequencies_hz": [50.0], "band_hz": (1.0, 5.0)}, "50 Hz is not inside the band"),
        ({"band_hz": (5.0, 1.0)}, "must rise"),
    ],
)
def test_impossible_requests(options, says):
    with pytest.raises(SetupError, match=says):
        IDENTIFY(line_response(2), **options)


def test_impossible_order():
    with pytest.raises(SetupError, match="max_order 0 must be at least 1"):
        PolyReferenceLeastSquares(max_order=0)


@pytest.mark.parametrize(
    ("spoil", "band_hz", "says"),
    [
        (
            lambda r: replace(r, values=np.full_like(r.values, np.nan)),
            None,
            "no line of any frequency response is finite",
        ),
        (lambda r: replace(r, excited=np.zeros_like(r.excited)), None, "no line is excited"),
        (lambda r: r, (20.0, 30.0), "holds no excited line; those are from 0.02 to"),
        (lambda r: r, (1.0, 1.05), "lines are too few"),
        (lambda r: r, (1.0, 1.01), "1 usable line is too few"),
    ],
)
def test_lines_that_hold_no_modes(spoil, band_hz, says):
    with pytest.raises(EstimateError, match=says):
        IDENTIFY(spoil(line_response(2)), band_hz=band_hz)


def test_mixed_motions_are_refused():
    response = line_response(2)
    mixed = (replace(response.responses[0], unit="m"), *response.responses[1:])
    with pytest.raises(EstimateError, match="several forms"):
        IDENTIFY(replace(response, responses=mixed))


@pytest.mark.parametrize(
    ("level", "expected"),
    [(1, [3.47, 3.96, 5.19, 6.61, 7.32, 9.17]), (3, [3.44, 3.90, 5.14, 6.55, 7.26, 9.12])],
)
def test_aircraft(shared_data, level, expected):
    with chladni.open_log(shared_data / f"f16_level{level}.mcap") as log:
        modes = IDENTIFY(chladni.frf(log, references="/shaker.wrench.force.z"))
    assert np.all((modes.frequency_hz > 2.002) & (modes.frequency_hz < 14.99))
    # The mode near 12.4 Hz is weak and may be missing.
    kept = modes.frequency_hz[np.abs(modes.frequency_hz - 12.4) > 0.2]
    np.testing.assert_allclose(kept, expected, atol=0.02)
    assert any("chi-square" in note for note in modes.provenance.notes)


@pytest.mark.nightly
def test_hammer(shared_data):
    with chladni.open_log(shared_data / "hammer.mcap") as log:
        modes = IDENTIFY(chladni.frf(log, references="/daq.hammer"), band_hz=(200.0, 3500.0))
    for expected in (447, 558, 731, 872, 1362, 1407, 2085, 2249, 2607, 3295):
        assert np.min(np.abs(modes.frequency_hz / expected - 1)) < 0.005
    assert np.all(np.isfinite(modes.frequency_std_hz) & (modes.frequency_std_hz > 0))
    assert modes.fit.error < 0.3
    # Ten strong peaks, some twenty weak ones that a person can see too.
    assert modes.frequency_hz.size < 32
