import numpy as np
import pytest

from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.pneumatic_motor import PNEUMATIC_MOTOR
from chladni.models.drives.seal_friction import ORIGIN, seal_friction, seal_friction_force
from chladni.models.integrator.simulate import simulate
from chladni.signals.channel import Channel
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries


@pytest.mark.parametrize("bar", [1, 4, 7])
def test_the_line_agrees_with_each_log_within_its_uncertainty(shared_data, bar):
    """Half the difference of force minus A p between both directions, mid-stroke."""
    columns = np.loadtxt(shared_data / f"pneumatic_seal_{bar}bar.csv").T
    x, p, f = columns[4], 1e5 * columns[5], columns[6]
    rising = np.gradient(np.convolve(np.pad(x, 10, "edge"), np.ones(21) / 21, "valid")) > 0
    inside = (x > 5) & (x < 30)
    friction = f - 4.95e-4 * p
    level = (friction[inside & rising].mean() - friction[inside & ~rising].mean()) / 2
    force, std = seal_friction_force(p.mean())
    assert abs(force - level) < std


def test_it_resists_the_piston_with_its_coulomb_force_once_the_seal_has_yielded():
    """A constant flow: dp A = Fc + b v in the end."""
    motor = drive_model(PNEUMATIC_MOTOR, {"viscous_loss": 0.0, "leakage": 0.0, "reduced_mass": 20.0})
    friction = seal_friction(4e5, active_area=70e-4)
    flow = TimeSeries(
        values=np.full((1, 1500), 70e-6), sample_rate_hz=500.0, channels=(Channel(name="flow", unit="m^3/s"),)
    )
    found = simulate(motor.with_effects([friction]), flow)
    motion = found.motion("piston")
    assert motion.displacement[-1] > 20e-3
    assert motion.force[-1] == pytest.approx(friction.values["force"], rel=1e-3)
    half = np.searchsorted(motion.displacement, 0.13e-3)
    assert 0.4 < motion.force[half] / friction.values["force"] < 0.8


def test_a_larger_piston_has_a_longer_seal():
    force, std = seal_friction_force(5e5)
    larger, wider = seal_friction_force(5e5, active_area=4 * 4.95e-4)
    assert (larger, wider) == pytest.approx((2 * force, 2 * std))
    assert seal_friction(5e5, joint="guide").site == "guide"
    assert seal_friction(5e5).values["force"] == force
    assert "CC0" in ORIGIN


@pytest.mark.parametrize("pressure_pa", [-1.0, 11e5, float("nan")])
def test_a_pressure_too_far_from_those_measured_is_refused(pressure_pa):
    with pytest.raises(ModelError, match="it was measured from 1 to 7 bar"):
        seal_friction_force(pressure_pa)


@pytest.mark.parametrize("area", [0.0, -1e-3, float("inf")])
def test_an_impossible_piston_is_refused(area):
    with pytest.raises(ModelError, match="active_area"):
        seal_friction(4e5, active_area=area)
