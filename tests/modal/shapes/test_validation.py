"""Findings on modes: each one when its cause is there, and none on sound modes."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from chladni.modal.shapes.validation import validate
from chladni.signals.channel import Channel
from chladni.signals.modal_fit import ModalFit
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spread import OrderSpread
from tests import strategies as ours
from tests.modal.mode_makers import mode_set

SOUND = np.array([[1.0, 0.5, -0.3], [-0.4, 1.0, 0.2]])


REFERENCE = (Channel(name="hammer", unit="N", role="reference"),)


def fitted(fit: ModalFit, **fields: Any) -> ModeSet:
    """The sound modes, from functions."""
    return mode_set(SOUND, references=REFERENCE, participation=np.ones((2, 1), complex), fit=fit, **fields)


def fit_of(
    function_error: list[float], band_error: list[float], poles_hz: tuple[float, ...] = (10.0, 20.0)
) -> ModalFit:
    count, bands = len(function_error), len(band_error)
    return ModalFit(
        frequency_hz=np.array([5.0, 10.0, 25.0]),
        synthesised=np.zeros((count, 1, 3), complex),
        lower_residual=np.zeros((count, 1), complex),
        upper_residual=np.zeros((count, 1), complex),
        error=max(function_error),
        function_error=np.array(function_error)[:, np.newaxis],
        bands_hz=np.array([[5.0, 15.0], [15.0, 25.0]])[:bands],
        band_error=np.array(band_error),
        poles_hz=np.array(poles_hz),
    )


def spread_of(orders: list[int], factor: float = 1.0) -> OrderSpread:
    modes = mode_set(SOUND)
    return OrderSpread(
        orders=np.array(orders),
        frequency_hz=modes.frequency_hz,
        frequency_std_hz=modes.frequency_std_hz * np.array([factor, 1.0]),
        damping_ratio=modes.damping_ratio,
        damping_std=modes.damping_std,
    )


def test_sound_modes_have_no_finding() -> None:
    found = validate(fitted(fit_of([0.01] * 3, [0.01, 0.02]), spread=spread_of([20, 18])))
    assert found.findings == ()
    assert found.alike == ()
    np.testing.assert_allclose(found.mpc, 1.0)
    np.testing.assert_allclose(found.mpd_deg, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.mean_phase_deg, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("modes", "words"),
    [
        (mode_set([[1.0, 0.5], [1.0, 0.55]]), "2 channels don't tell the shapes of modes 1 and 2 (10 and 20 Hz"),
        (
            mode_set([[1.0, 0.5], [1.0, 0.5]], frequency_hz=np.array([10.0, 10.002])),
            "Modes 1 and 2 (10 and 10 Hz) may be one mode found twice: their frequencies differ by 0.002 Hz",
        ),
        (mode_set([[1.0, 0.0], [0.0, 1.0], [1.0, -1.0]]), "2 channels for 3 modes: shapes of so few components"),
        (
            fitted(fit_of([0.3, 0.01, 0.5], [0.01, 0.02])),
            "The synthesis misses c2 over hammer (50 %) and c0 over hammer (30 %) by more than 20 %",
        ),
        (
            fitted(fit_of([0.01] * 3, [0.3, 0.4])),
            "The synthesis is off by more than 20 % (RMS over RMS) between 15 and 25 Hz (40 %) and between 5",
        ),
        (mode_set(SOUND, spread=spread_of([3, 30])), "Mode 1 (10 Hz) came out at only 3 model orders (the best"),
        (mode_set(SOUND, spread=spread_of([30, 7])), "Mode 2 (20 Hz) came out at only 7 model orders"),
        (
            mode_set(SOUND, spread=spread_of([30, 30], 5.0)),
            "Mode 1 (10 Hz): the scatter over model orders exceeds 3 times the error bar",
        ),
        (
            mode_set(SOUND, damping_ratio=np.array([0.01, 0.3])),
            "Mode 2 (20 Hz) has a damping ratio of 30 %: above 10",
        ),
        (
            mode_set(SOUND, frequency_std_hz=np.array([0.5, 0.01])),
            "Mode 1 (10 Hz): one sigma of the frequency is 5 % (limit 1 %): average longer",
        ),
        (mode_set(SOUND, damping_std=np.array([1e-4, 0.005])), "Mode 2 (20 Hz): one sigma of the damping is 50 %"),
        (
            mode_set(SOUND, shape_std=np.full((2, 3), 0.15 + 0j)),
            "Modes 1 and 2 (10 and 20 Hz): one sigma of the shape is 15 and 15 %",
        ),
        (
            mode_set(SOUND, frequency_std_hz=np.array([np.nan, 0.01])),
            "Mode 1 (10 Hz): the error bars are unknown.",
        ),
        (
            mode_set([[1.0, 0.8j, -0.2]]),
            "Mode 1 (10 Hz): the phases of its shape are not collinear (MPC 0.06, limit 0.9; MPD",
        ),
    ],
)
def test_each_cause_has_its_finding(modes: ModeSet, words: str) -> None:
    findings = validate(modes).findings
    assert any(finding.startswith(words) for finding in findings), findings
    assert all("\n" not in finding and finding.endswith(".") for finding in findings)


def test_noise_is_no_complex_mode() -> None:
    shape = np.array([[1.0, 0.3 + 0.3j, -0.3 + 0.25j]])
    sharp = validate(mode_set(shape)).findings
    blurred = validate(mode_set(shape, shape_std=np.full((1, 3), 0.3 * (1 + 1j)))).findings
    assert any("more than its error bars explain" in finding for finding in sharp)
    assert any("the error bars of the shape explain it" in finding for finding in blurred)


def test_the_gravest_come_first() -> None:
    poor = mode_set([[1.0, 0.5], [1.0, 0.5], [1.0, 1j]], damping_ratio=np.array([0.01, 0.01, 0.5]))
    order = ("don't tell the shapes", "2 channels for 3 modes", "damping ratio of 50 %", "not collinear")
    places = [next(row for row, text in enumerate(validate(poor).findings) if word in text) for word in order]
    assert places == sorted(places)


def test_no_modes_is_an_answer() -> None:
    none = mode_set(np.zeros((0, 3)), frequency_hz=np.zeros(0))
    found = validate(none)
    assert found.auto_mac.shape == (0, 0)
    assert found.findings == ()


@given(ours.mode_sets())
def test_any_modes_can_be_validated(modes: Any) -> None:
    found = validate(modes)
    count = modes.frequency_hz.size
    assert found.auto_mac.shape == (count, count)
    # A single channel has no phase to compare.
    known = np.full(count, len(modes.channels) > 1)
    np.testing.assert_array_equal(np.isfinite(found.mpc), known)
    assert np.all((found.mpc[known] >= 0) & (found.mpc[known] <= 1))


def test_units_keep_their_case_at_the_start_of_a_sentence() -> None:
    assert "Mode 1 (10 Hz)" in validate(mode_set([[1.0, 0.8j, -0.2]])).findings[0]
