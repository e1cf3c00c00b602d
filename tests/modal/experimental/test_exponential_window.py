"""Modes of windowed functions, whose poles without the window are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.experimental.circle_fit import CircleFit
from chladni.modal.experimental.exponential_window import without_window_damping
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spread import OrderSpread
from chladni.signals.provenance import Provenance
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.time_series import TimeSeries
from chladni.spectral.frf import frequency_response
from chladni.spectral.impact import find_impacts, impact_cross_spectra

FORCE = Channel(name="/hammer", unit="N", role="reference", point="a", direction=(1.0, 0.0, 0.0))
BASE = replace(FORCE, name="/base", unit="m/s^2", role="response")


def mode_set(poles, *, shapes=None, participation=None, units=("m/s^2",), std=0.0, **fields):
    poles = np.asarray(poles, dtype=complex)
    shapes = np.ones((poles.size, len(units)), complex) if shapes is None else np.asarray(shapes, complex)
    return ModeSet(
        frequency_hz=np.abs(poles) / (2 * np.pi),
        frequency_std_hz=np.full(poles.size, std),
        damping_ratio=-poles.real / np.abs(poles),
        damping_std=np.full(poles.size, std),
        shapes=shapes,
        shape_std=0 * shapes,
        channels=tuple(replace(BASE, name=f"/c{row}", unit=unit) for row, unit in enumerate(units)),
        references=(FORCE,),
        participation=participation,
        **{"provenance": Provenance(window_decay_per_s=7.0), **fields},
    )


@given(
    omega=st.floats(10.0, 1e4),
    zeta=st.floats(1e-4, 0.3),
    share=st.floats(1e-3, 0.5),
)
def test_the_pole_without_the_window_comes_back(omega, zeta, share):
    decay = share * omega
    truth = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
    if abs(truth - decay) <= decay:
        return
    windowed = mode_set([truth - decay], provenance=Provenance())
    corrected = without_window_damping(windowed, decay)
    np.testing.assert_allclose(corrected.poles, [truth], rtol=1e-10)
    assert abs(windowed.poles[0] - truth) > 0.9 * decay


def test_participation_and_scale_are_those_of_the_true_receptance():
    """(s + sigma)^2 psi L/(s + sigma - pole) fitted as s^2 psi' L'/(s - pole'): equal where both have their pole."""
    decay, true_poles = 7.0, np.array([-3 + 200j, -5 + 450j])
    shapes = np.array([[1.0, 0.5 + 0.1j], [-0.4, 1.0]])
    true_participation = np.array([[2e-3 - 1e-3j], [1e-3 - 5e-3j]])
    measured = true_participation * (true_poles / (true_poles - decay))[:, None] ** 2
    scale = ModalScale(
        response="/c0",
        reference="/hammer",
        modal_a=shapes[:, 0] / measured[:, 0],
        modal_mass=(shapes[:, 0] / measured[:, 0] / (2j * true_poles.imag)).real,
        modal_mass_std=np.array([0.1, 0.1]),
    )
    modes = mode_set(true_poles - decay, shapes=shapes, participation=measured, units=("m/s^2", "m/s^2"), scale=scale)
    corrected = without_window_damping(modes, decay)
    np.testing.assert_allclose(corrected.participation, true_participation, rtol=1e-12)
    np.testing.assert_array_equal(corrected.shapes, shapes)
    true_a = shapes[:, 0] / true_participation[:, 0]
    np.testing.assert_allclose(corrected.scale.modal_a, true_a, rtol=1e-12)
    np.testing.assert_allclose(corrected.scale.modal_mass, (true_a / (2j * true_poles.imag)).real, rtol=1e-12)


def test_responses_of_several_forms_are_each_turned_by_their_own():
    decay, pole = 7.0, -3 + 200j
    ratio = pole / (pole - decay)
    true_shape = np.array([[0.5, 1.0, 0.25]], complex)
    # Receptance, mobility, accelerance: what s^n psi L is at the pole, with the largest component 1 again.
    seen = true_shape * ratio ** np.array([0, 1, 2])
    modes = mode_set(
        [pole - decay],
        shapes=seen / seen[0, 1],
        participation=np.array([[3e-3j]]) * seen[0, 1],
        units=("m", "m/s", "m/s^2"),
    )
    corrected = without_window_damping(modes, decay)
    np.testing.assert_allclose(corrected.shapes, true_shape, rtol=1e-12)
    np.testing.assert_allclose(corrected.participation, [[3e-3j]], rtol=1e-12)
    assert corrected.shapes[0, 1] == 1


def test_sigma_follows_by_the_derivatives():
    """Against the scatter of 20 000 moved poles, which is known to 0.5 %."""
    random = np.random.default_rng(2)
    omega, zeta, decay = 100.0, 0.3, 20.0
    std_hz, zeta_std = 0.02, 0.01
    frequency_hz = omega / (2 * np.pi) + std_hz * random.standard_normal(20_000)
    ratio = zeta + zeta_std * random.standard_normal(20_000)
    drawn = 2 * np.pi * frequency_hz * (-ratio + 1j * np.sqrt(1 - ratio**2)) + decay
    pole = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
    modes = replace(mode_set([pole]), frequency_std_hz=np.array([std_hz]), damping_std=np.array([zeta_std]))
    corrected = without_window_damping(replace(modes, provenance=Provenance()), decay)
    assert corrected.frequency_std_hz[0] == pytest.approx(np.std(np.abs(drawn)) / (2 * np.pi), rel=0.03)
    assert corrected.damping_std[0] == pytest.approx(np.std(-drawn.real / np.abs(drawn)), rel=0.03)
    assert corrected.frequency_std_hz[0] > 1.5 * std_hz


def test_it_is_said_by_how_much():
    poles = np.array([-8 + 200j, -10 + 400j])
    corrected = without_window_damping(mode_set(poles), 7.0)
    assert corrected.provenance.window_decay_per_s == 0.0
    (note,) = corrected.provenance.notes
    assert note.startswith("the exponential window of 7/s is taken off: damping ratios are 0.035 to 0.0175 lower")
    # What is taken off already isn't taken off again by whoever goes by the provenance.
    assert without_window_damping(corrected, corrected.provenance.window_decay_per_s) is corrected


def test_a_mode_without_damping_left_is_kept_out_and_named():
    poles = np.array([-6 + 200j, -10 + 400j])
    orders = OrderSpread(
        orders=np.array([5, 9]),
        frequency_hz=np.abs(poles) / (2 * np.pi),
        frequency_std_hz=np.array([0.1, 0.2]),
        damping_ratio=-poles.real / np.abs(poles),
        damping_std=np.array([1e-3, 2e-3]),
    )
    diagram = StabilisationDiagram(
        order=np.array([4, 4, 6]),
        frequency_hz=np.array([31.0, 63.0, 63.0]),
        damping_ratio=np.array([0.03, 0.02, 0.02]),
        status=np.array([0, 0, 1]),
        mode=np.array([0, 1, -1]),
        indicator_hz=np.arange(3.0),
        indicator=np.ones((1, 3)),
        indicator_name="CMIF",
        indicator_unit="(m/s^2)/N",
    )
    modes = mode_set(
        poles,
        participation=np.ones((2, 1), complex),
        spread=orders,
        stabilisation=diagram,
        scale=ModalScale(
            response="/c0",
            reference="/hammer",
            modal_a=np.ones(2, complex),
            modal_mass=np.ones(2),
            modal_mass_std=np.ones(2),
        ),
    )
    corrected = without_window_damping(modes, 7.0)
    np.testing.assert_allclose(corrected.poles, [-3 + 400j], rtol=1e-12)
    np.testing.assert_allclose(corrected.spread.damping_ratio, corrected.damping_ratio, rtol=1e-12)
    np.testing.assert_array_equal(corrected.spread.orders, [9])
    np.testing.assert_array_equal(corrected.stabilisation.mode, [-1, 0, -1])
    assert corrected.scale.modal_mass.shape == (1,)
    assert corrected.participation.shape == (1, 1)
    assert "the mode at 31.845 Hz is left out: its damping ratio of 0.03 is less" in corrected.provenance.notes[1]


def test_modes_that_change_places_stay_in_order():
    poles = np.array([-9 + 200.0j, -40 + 196.5j])
    order = np.argsort(np.abs(poles))
    corrected = without_window_damping(mode_set(poles[order]), 7.0)
    np.testing.assert_allclose(corrected.poles, [-33 + 196.5j, -2 + 200j], rtol=1e-12)
    assert np.all(np.diff(corrected.frequency_hz) >= 0)


def test_units_that_are_no_motion_are_told():
    modes = mode_set([-9 + 200j], participation=np.ones((1, 1), complex), units=("V",))
    corrected = without_window_damping(modes, 7.0)
    np.testing.assert_array_equal(corrected.participation, modes.participation)
    assert "are no motion" in corrected.provenance.notes[-1]


def test_rates_that_can_not_be_are_refused():
    modes = mode_set([-9 + 200j])
    for rate in (-1.0, np.nan, np.inf):
        with pytest.raises(EstimateError, match="finite and 0 or positive"):
            without_window_damping(modes, rate)
    with pytest.raises(EstimateError, match="measured through 7/s; give that rate"):
        without_window_damping(modes, 5.0)


def test_an_empty_set_stays_one():
    corrected = without_window_damping(mode_set([]), 7.0)
    assert corrected.frequency_hz.size == 0
    assert corrected.provenance.notes == ()


RATE_HZ = 2000.0
NATURAL_HZ, DAMPING = 60.0, 0.002


def hammer_test(decay_per_s, *, both=True, noise=0.0, seed=0, hits=6):
    """Six hits on one lightly damped mass, 20 s apart, of which 2 s are used: it still rings at the end."""
    samples = round(20 * hits * RATE_HZ)
    force = np.zeros(samples)
    width = 10
    for hit in range(hits):
        start = round((1 + 20 * hit) * RATE_HZ)
        force[start : start + width] = 100 * np.sin(np.pi * np.arange(width) / width)
    s = 2j * np.pi * np.fft.rfftfreq(samples, 1 / RATE_HZ)
    omega = 2 * np.pi * NATURAL_HZ
    motion = np.fft.irfft(np.fft.rfft(force) * s**2 / (2.0 * (s**2 + 2 * DAMPING * omega * s + omega**2)), samples)
    values = np.vstack([force, motion])
    values[1] += noise * np.abs(motion).max() * np.random.default_rng(seed).standard_normal(samples)
    series = TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=(FORCE, BASE))
    impacts = find_impacts(series, force="/hammer", record_s=2.0)
    if both:
        spectra = impact_cross_spectra(series, impacts, decay_per_s=decay_per_s)
        return frequency_response(spectra, references="/hammer")
    spectra = impact_cross_spectra(windowed_responses(series, impacts, decay_per_s), impacts)
    response = frequency_response(spectra, references="/hammer")
    return replace(response, provenance=replace(response.provenance, window_decay_per_s=decay_per_s))


def untold(response):
    """The same functions, whose provenance doesn't tell the window."""
    return replace(response, provenance=replace(response.provenance, window_decay_per_s=0.0))


def windowed_responses(series, impacts, decay_per_s):
    """As analysers do that put the exponential window on the responses only."""
    values = np.array(series.values)
    since = np.arange(round(impacts.record_s * RATE_HZ)) / RATE_HZ
    for hit in impacts.accepted:
        first = round((hit.time_s - impacts.pretrigger_s) * RATE_HZ)
        values[1, first : first + since.size] *= np.exp(-decay_per_s * since)
    return replace(series, values=values)


@pytest.mark.parametrize("both", [pytest.param(True, marks=pytest.mark.nightly), False])
def test_a_hammer_test_has_the_right_damping_after_the_correction_and_the_wrong_one_before(both):
    decay = 4.0
    off, wrong = [], []
    for seed in range(8):
        response = hammer_test(decay, both=both, noise=2e-3, seed=seed)
        modes = CircleFit().identify(untold(response), band_hz=(40.0, 80.0), count=1)
        corrected = CircleFit().identify(response, band_hz=(40.0, 80.0), count=1)
        assert corrected.provenance.window_decay_per_s == 0.0
        wrong.append((modes.damping_ratio[0] - DAMPING) / modes.damping_std[0])
        off.append((corrected.damping_ratio[0] - DAMPING) / corrected.damping_std[0])
        assert abs(corrected.frequency_hz[0] - NATURAL_HZ) < 4 * corrected.frequency_std_hz[0]
    # The window adds 0.0106 to a damping ratio of 0.002.
    assert np.min(wrong) > 10
    # Of 8 Gaussian numbers 3 lie beyond two sigma once in 200 times, and one beyond 4 never.
    assert np.count_nonzero(np.abs(off) > 2) <= 2
    assert np.max(np.abs(off)) < 4


def test_participation_of_a_hammer_test_is_that_of_the_mass():
    """L = 1/(2 j omega_d m); a window on the responses only scales it by its value at the hit, 10 ms in."""
    truth = 1 / (2j * 2 * np.pi * NATURAL_HZ * np.sqrt(1 - DAMPING**2) * 2.0)
    for both in (True, False):
        modes = CircleFit().identify(untold(hammer_test(4.0, both=both)), band_hz=(40.0, 80.0), count=1)
        before, after = (m.participation[0, 0] / truth for m in (modes, without_window_damping(modes, 4.0)))
        # The factor (lambda/(lambda - sigma))^2 is a turn by 2 sigma/omega = 0.0212.
        assert abs(np.angle(before)) == pytest.approx(0.0212, abs=0.003)
        assert abs(np.angle(after)) < 0.003
        assert abs(after) == pytest.approx(1.0 if both else np.exp(-4.0 * 0.010), abs=0.01)
