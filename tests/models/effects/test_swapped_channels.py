from dataclasses import replace

import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.excitations.random_noise import RandomNoise
from chladni.models.integrator.simulate import simulate
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import one_body
from tests.models.structures.made_models import axis, tree

FREQUENCY_HZ = np.linspace(0.1, 20.0, 30)


def test_each_stands_under_the_others_name_with_all_that_acts_on_it() -> None:
    clipped = attached("clipping", "acc", {"limit": 3.0}).attach(one_body())
    late = attached("time_offset", "place", {"offset": 0.02}).attach(clipped)
    swapped = attached("swapped_channels", "place~acc", {}).attach(late)
    wanted = late.frequency_response(FREQUENCY_HZ)[[2, 1, 0]]
    np.testing.assert_allclose(swapped.frequency_response(FREQUENCY_HZ), wanted, rtol=1e-12)
    assert swapped.outputs == late.outputs
    assert swapped.output_maps == ((2, late.output_maps[0][1]),)
    assert swapped.output_offsets_s == (0.02, 0.0, 0.0)


def test_twice_is_not_at_all() -> None:
    swap = attached("swapped_channels", "acc~speed", {})
    np.testing.assert_array_equal(swap.attach(swap.attach(one_body())).c, one_body().c)


def test_a_controller_saw_its_own_sensor() -> None:
    whole = axis().compile()
    swapped = axis().with_effects((attached("swapped_channels", "position~speed", {}),)).compile()
    np.testing.assert_array_equal(swapped.a, whole.a)
    np.testing.assert_array_equal(swapped.c[[1, 0]], whole.c[[0, 1]])


def test_a_simulation_shows_it() -> None:
    plain = replace(tree(), controllers=())
    first, second = (one.name for one in plain.outputs[:2])
    real = plain.with_effects((attached("swapped_channels", f"{first}~{second}", {}),))
    runs = [simulate(model, RandomNoise(rms=10.0), duration_s=0.5, sample_rate_hz=1000.0) for model in (plain, real)]
    np.testing.assert_allclose(runs[1].outputs.values[[1, 0]], runs[0].outputs.values[:2])


def test_one_output_is_no_pair() -> None:
    with pytest.raises(ModelError, match="acts at a pair of outputs such as left~right, and there is no 'acc~spedd'"):
        attached("swapped_channels", "acc~spedd", {}).attach(one_body())
