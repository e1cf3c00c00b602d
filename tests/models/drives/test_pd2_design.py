import numpy as np
import pytest
from scipy import signal

from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.hydraulic_motor import HYDRAULIC_MOTOR
from chladni.models.drives.pd2 import PD2_PARAMETERS
from chladni.models.drives.pd2_design import best_pd2, cancelling_pd2
from chladni.signals.errors import ModelError

OMEGA, ZETA = 200.0, 0.1


def velocity_and_flow(design, *, omega=OMEGA, zeta=ZETA):
    """Step responses by SciPy's transfer functions; the drive has a static gain of one."""
    time = np.linspace(0.0, 40.0 / omega, 4001)
    above = [design.second_derivative_s2, design.derivative_s, 1.0]
    below = np.polymul([design.filter_s, 1.0], [design.filter_s, 1.0])
    _, flow = signal.step((above, below), T=time)
    drive = [1 / omega**2, 2 * zeta / omega, 1.0]
    _, velocity = signal.step((above, np.polymul(below, drive)), T=time)
    return time, velocity, flow


@pytest.mark.parametrize("design", [best_pd2, cancelling_pd2])
@pytest.mark.parametrize("zeta", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("flow_ratio", [1.5, 2.0, 4.0])
def test_flow_keeps_its_bound_and_uses_it(design, zeta, flow_ratio):
    found = design(omega=OMEGA, damping_ratio=zeta, flow_ratio=flow_ratio)
    _, _, flow = velocity_and_flow(found, zeta=zeta)
    assert np.abs(flow).max() == pytest.approx(flow_ratio, rel=1e-6)
    assert found.largest_flow == pytest.approx(flow_ratio, rel=1e-6)


@pytest.mark.parametrize("design", [best_pd2, cancelling_pd2])
def test_settling_time_is_that_of_the_response(design):
    found = design(omega=OMEGA, damping_ratio=ZETA)
    time, velocity, _ = velocity_and_flow(found)
    last = np.flatnonzero(np.abs(velocity - 1) > 0.05)[-1]
    # Both grids have steps of 40/omega/4096 at most.
    assert found.settling_s == pytest.approx(time[last], abs=4 * 40 / OMEGA / 4096)


def test_cancelling_leaves_two_lags():
    found = cancelling_pd2(omega=OMEGA, damping_ratio=ZETA, flow_ratio=2.0)
    time, velocity, _ = velocity_and_flow(found)
    lag = 1 / (OMEGA * np.sqrt(2.0))
    # 1e-7: the oscillating pair cancels in transfer functions to rounding only.
    np.testing.assert_allclose(velocity, 1 - (1 + time / lag) * np.exp(-time / lag), atol=1e-7)


@pytest.mark.nightly
@pytest.mark.parametrize("zeta", [0.02, 0.1, 0.2, 0.4])
def test_no_other_correction_near_it_settles_sooner(zeta):
    best = best_pd2(omega=1.0, damping_ratio=zeta)
    assert best.settling_s < 0.85 * cancelling_pd2(omega=1.0, damping_ratio=zeta).settling_s
    rng = np.random.default_rng(3)
    for _ in range(8):
        lag = best.filter_s * rng.uniform(0.7, 1.4)
        other = type(best)(
            derivative_s=best.derivative_s + rng.uniform(-0.3, 0.3), second_derivative_s2=2 * lag**2, filter_s=lag,
            settling_s=0.0, largest_flow=2.0,
        )  # fmt: skip
        time, velocity, flow = velocity_and_flow(other, omega=1.0, zeta=zeta)
        if np.abs(flow).max() <= 2.0 + 1e-9:
            settled = time[np.flatnonzero(np.abs(velocity - 1) > 0.05)[-1]]
            assert settled > best.settling_s - 0.02


def test_a_faster_drive_has_the_same_correction_in_its_own_time():
    slow, fast = (best_pd2(omega=omega, damping_ratio=ZETA) for omega in (1.0, 250.0))
    assert fast.derivative_s == pytest.approx(slow.derivative_s / 250, rel=1e-9)
    assert fast.second_derivative_s2 == pytest.approx(slow.second_derivative_s2 / 250**2, rel=1e-9)
    assert fast.settling_s == pytest.approx(slow.settling_s / 250, rel=1e-9)


@pytest.mark.parametrize("zeta", [0.0, 1.0])
def test_ends_of_the_range_have_a_design(zeta):
    best = best_pd2(omega=OMEGA, damping_ratio=zeta, flow_ratio=20.0)
    assert best.filter_s > 0
    assert best.largest_flow == pytest.approx(20.0, rel=1e-6)


def test_defaults_of_the_hydraulic_motor_are_its_best():
    pole = drive_model(HYDRAULIC_MOTOR).compile().state_space().poles()[1]
    best = best_pd2(omega=abs(pole), damping_ratio=-pole.real / abs(pole))
    # The defaults are rounded to three digits.
    for name, value in best.parameters().items():
        assert PD2_PARAMETERS[name].value == pytest.approx(value, rel=5e-3), name


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"omega": 0.0}, r"omega = 0\.0 rad/s must be finite and positive"),
        ({"damping_ratio": 1.2}, r"damping_ratio = 1\.2: a pair that oscillates has one from 0 to 1"),
        ({"flow_ratio": 1.0}, r"flow_ratio = 1\.0 must be above 1"),
        ({"band": 0.0}, r"band = 0\.0 must lie between 0 and 1"),
        ({"band": 1.0}, r"band = 1\.0 must lie between 0 and 1"),
        ({"band": float("nan")}, "band = nan must lie between 0 and 1"),
    ],
)
def test_impossible_numbers_are_refused(changes, message):
    for design in (best_pd2, cancelling_pd2):
        with pytest.raises(ModelError, match=message):
            design(**{"omega": OMEGA, "damping_ratio": ZETA, **changes})
