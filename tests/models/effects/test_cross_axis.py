import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.cross_axis import attach
from chladni.models.effects.effect_kind import Site
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import one_body, with_loop

FREQUENCY_HZ = np.linspace(0.1, 20.0, 30)


def test_a_share_of_the_other_output_is_added() -> None:
    before = one_body().frequency_response(FREQUENCY_HZ)
    felt = attached("cross_axis", "acc", {"coefficient": 0.2}, source="speed").attach(one_body())
    after = felt.frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(after[0], before[0] + 0.2 * before[1], rtol=1e-12)
    np.testing.assert_allclose(after[1:], before[1:], rtol=1e-15)


def test_in_a_loop_the_controller_sees_the_share_too() -> None:
    # place + 0.01 speed fed back: the same as a controller with gain and rate.
    plant = attached("cross_axis", "place", {"coefficient": 0.01}, source="speed").attach(one_body(), in_loop=True)
    closed = with_loop(plant, gain=300.0).frequency_response(FREQUENCY_HZ)
    outside = with_loop(
        attached("cross_axis", "place", {"coefficient": 0.01}, source="speed").attach(one_body()), gain=300.0
    )
    s = 2j * np.pi * FREQUENCY_HZ
    open_loop = 300.0 * (1 + 0.01 * s) / (2.0 * s**2 + 4.0 * s + 800.0)
    np.testing.assert_allclose(closed[2, 0], open_loop / (1 + open_loop), rtol=1e-10)
    np.testing.assert_allclose(outside.frequency_response(FREQUENCY_HZ)[2], closed[2], rtol=1e-12)


def test_laws_behind_it_see_the_share() -> None:
    plant = attached("cross_axis", "place", {"coefficient": 0.01}, source="speed").attach(one_body(), in_loop=True)
    clipped = attached("clipping", "place", {"limit": 1.0}).attach(plant)
    port = clipped.laws[-1].port
    np.testing.assert_allclose(clipped.displacement_state[port], [1.0, 0.01])


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (None, r"cross_axis at 'acc': name the output that it listens to as source"),
        ("acc", r"cross_axis at 'acc': its source is another output, not itself"),
    ],
)
def test_a_source_is_needed_and_is_another_output(source: str | None, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        attached("cross_axis", "acc", {"coefficient": 0.2}, source=source)


def test_a_source_that_is_no_output_is_told_with_the_nearest() -> None:
    effect = attached("cross_axis", "acc", {"coefficient": 0.2}, source="sped")
    with pytest.raises(ModelError, match=r"cross_axis at 'acc': no output 'sped'; did you mean speed\?"):
        effect.attach(one_body())


def test_other_effects_take_no_source() -> None:
    with pytest.raises(ModelError, match=r"gain_error at 'acc': it listens to no other output; leave 'speed' out"):
        attached("gain_error", "acc", {"gain": 1.1}, source="speed")


def test_behind_a_change_of_samples_it_is_refused() -> None:
    clipped = attached("clipping", "acc", {"limit": 1.0}).attach(one_body())
    with pytest.raises(ModelError, match=r"list it before clipping"):
        attached("cross_axis", "acc", {"coefficient": 0.2}, source="speed").attach(clipped)


def test_the_way_to_attach_asks_for_a_source_too() -> None:
    site = Site(effect="cross_axis", name="acc", kind="output")
    with pytest.raises(ModelError, match=r"cross_axis at 'acc': name another output as its source"):
        attach(one_body(), site, {"coefficient": 0.1})
