import numpy as np

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import driven
from tests.models.effects.small_models import one_body, with_loop

RATE_HZ = 100.0


def test_a_step_becomes_a_ramp_and_slow_signals_pass() -> None:
    effect = attached("rate_limit", "motor", {"rate": 50.0})
    ((_, action),) = effect.attach(one_body()).input_maps
    ramp = action(np.full(40, 10.0), RATE_HZ)
    np.testing.assert_allclose(ramp, np.minimum(0.5 * np.arange(1, 41), 10.0))
    slow = 0.4 * np.arange(40)
    np.testing.assert_array_equal(action(slow, RATE_HZ), slow)


def test_no_change_is_faster_than_the_rate() -> None:
    ((_, action),) = attached("rate_limit", "motor", {"rate": 50.0}).attach(one_body()).input_maps
    found = action(np.random.default_rng(5).normal(size=500), RATE_HZ)
    assert np.max(np.abs(np.diff(found))) <= 0.5 * (1 + 1e-12)


def test_in_a_loop_a_tracker_runs_at_the_rate_and_then_closes_in() -> None:
    effect = attached("rate_limit", "motor", {"rate": 50.0, "tracking_time": 0.01})
    (law,) = effect.attach(with_loop(one_body())).laws
    times_s = np.linspace(0.0, 0.4, 81)
    acts = 10.0 + driven(law, lambda _t: 10.0, lambda _t: 0.0, times_s)
    # A ramp until the distance is rate times tracking time, 0.5 at 0.19 s, then an exponential.
    wanted = np.where(times_s < 0.19, 50.0 * times_s, 10.0 - 0.5 * np.exp(-(times_s - 0.19) / 0.01))
    np.testing.assert_allclose(acts, wanted, atol=1e-6)
