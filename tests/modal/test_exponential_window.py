"""Modes of windowed functions, whose poles without the window are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.exponential_window import without_window_damping
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spread import OrderSpread
from chladni.signals.provenance import Provenance
from chladni.signals.stabilisation_diagram import StabilisationDiagram

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
