import numpy as np
import pytest

from chladni.models.core.simulation import PortMotion, Simulation
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.softening_stiffness import valid_range
from chladni.signals.channel import Channel
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries
from tests.models.effects.motions import force, law_of
from tests.models.effects.small_models import STIFFNESS, one_body

CUBIC = -2e6
END = valid_range(CUBIC, STIFFNESS)
EFFECT = attached("softening_stiffness", "spring", {"cubic": CUBIC})


def _total(d: float) -> float:
    """Force of the whole joint."""
    return STIFFNESS * d + force(law_of(EFFECT, one_body()), d=d)


def _moved(reached: float) -> Simulation:
    """A simulation in which the joint got as far as that."""
    channel = Channel(name="a", unit="m")
    nothing = TimeSeries(values=np.zeros((1, 2)), sample_rate_hz=1.0, channels=(channel,))
    moved = PortMotion(
        name="spring", kind="joint", displacement=np.array([0.0, -reached]), velocity=np.zeros(2), force=np.zeros(2)
    )
    return Simulation(
        model="m", inputs=nothing, outputs=nothing, states=np.zeros((0, 2)), state_names=(), motions=(moved,)
    )


def test_inside_the_range_it_is_a_cube() -> None:
    assert _total(0.5 * END) == pytest.approx(STIFFNESS * 0.5 * END + CUBIC * (0.5 * END) ** 3, rel=1e-14)


def test_the_joints_force_is_largest_at_the_end_of_the_range_and_stays() -> None:
    # d(k d + cubic d^3) = 0 at the end, where two thirds of the linear force are left.
    plateau = 2 / 3 * STIFFNESS * END
    for factor in (1.0, 1.5, 40.0):
        assert _total(factor * END) == pytest.approx(plateau, rel=1e-12)
        assert _total(-factor * END) == pytest.approx(-plateau, rel=1e-12)
    assert _total(0.99 * END) < plateau


def test_the_slope_is_continuous_at_the_end() -> None:
    step = 1e-7 * END
    inner, outer = _total(END) - _total(END - step), _total(END + step) - _total(END)
    assert inner == pytest.approx(0.0, abs=1e-6 * STIFFNESS * step)
    assert outer == pytest.approx(0.0, abs=1e-6 * STIFFNESS * step)


def test_a_joint_without_spring_cannot_soften() -> None:
    with pytest.raises(ModelError, match=r"softening_stiffness at 'spring': the joint has no spring"):
        EFFECT.attach(one_body(stiffness=0.0))


def test_a_yielding_spring_begins_as_the_cube_and_keeps_what_is_not_lost() -> None:
    law = law_of(
        attached("softening_stiffness", "spring", {"cubic": CUBIC, "lost": 0.7}, variant="yielding"), one_body()
    )
    near, far = 0.01 * END, 1e5 * END
    assert force(law, d=near) == pytest.approx(CUBIC * near**3, rel=1e-3)
    assert force(law, d=far) == pytest.approx(-0.7 * STIFFNESS * far, rel=1e-4)
    whole = [STIFFNESS * d + force(law, d=d) for d in np.linspace(0.0, 50 * END, 500)]
    assert np.all(np.diff(whole) > 0)


def test_a_yielding_spring_that_loses_all_ends_at_a_force() -> None:
    law = law_of(attached("softening_stiffness", "spring", {"cubic": CUBIC}, variant="yielding"), one_body())
    far = 1e5 * END
    plateau = STIFFNESS * np.sqrt(STIFFNESS / (-2 * CUBIC))
    assert STIFFNESS * far + force(law, d=far) == pytest.approx(plateau, rel=1e-4)


@pytest.mark.parametrize(("reached", "flagged"), [(0.9 * END, False), (1.2 * END, True)])
def test_leaving_the_range_is_flagged(reached: float, flagged: bool) -> None:
    flags = EFFECT.flags(one_body(), _moved(reached))
    assert len(flags) == int(flagged)
    if flagged:
        assert "softening_stiffness at spring: displacement 13.9 mm leaves the valid range of 11.5 mm" in flags[0]


def test_a_yielding_spring_is_valid_everywhere() -> None:
    simulation = _moved(40 * END)
    effect = attached("softening_stiffness", "spring", {"cubic": CUBIC}, variant="yielding")
    assert effect.flags(one_body(), simulation) == ()


def test_other_effects_flag_nothing() -> None:
    channel = Channel(name="a", unit="m")
    nothing = TimeSeries(values=np.zeros((1, 2)), sample_rate_hz=1.0, channels=(channel,))
    simulation = Simulation(
        model="m", inputs=nothing, outputs=nothing, states=np.zeros((0, 2)), state_names=(), motions=()
    )
    assert attached("backlash", "spring", {"gap": 1e-4}).flags(one_body(), simulation) == ()
