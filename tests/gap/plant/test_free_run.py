from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from chladni.signals.errors import ModelError
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

HARDENING = attached("hardening_stiffness", "j1", {"cubic": 1e12})
FRICTION = attached("coulomb_friction", "j1", {"force": 8.0})


@pytest.fixture(scope="module")
def signals():
    return band_noise(2000)


@pytest.fixture(scope="module")
def log(signals):
    return measured(three_bodies(), signals, outputs=[2, 0])[0]


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (FRICTION,),
        (attached("delay", "hammer", {"delay": 1.3e-3}),),
        (attached("clipping", "a0", {"limit": 10.0}),),
        (attached("time_offset", "a2", {"offset": 0.4e-3}),),
        (attached("extra_mode", "b1", {"mass": 0.3, "frequency": 60.0, "damping_ratio": 0.02}),),
        (FRICTION, attached("saturation", "hammer", {"limit": 60.0})),
    ],
    ids=lambda effects: "+".join(effect.effect for effect in effects) or "none",
)
def test_outputs_are_those_of_the_integrator(effects, signals, log):
    run = FreeRun(three_bodies(), log, tolerance=1e-9)
    z = np.linspace(-1, 1, 9)
    model = three_bodies().with_values(run.tunables.values(z)).with_effects(effects)
    compiled = model.compile()
    initial = np.zeros(len(compiled.states))
    initial[1] = 1e-4
    expected = Integrator(compiled, RATE_HZ, tolerance=1e-9).run(signals, initial=initial).outputs[[2, 0]]
    found = run.outputs(z, effects, initial)
    # Both are exact between samples but for rounding, or use the same steps.
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_effects_join_those_that_the_model_has(signals, log):
    both = FreeRun(three_bodies(), log).outputs(effects=[FRICTION])
    known = FreeRun(three_bodies().with_effects([FRICTION]), log).outputs()
    np.testing.assert_array_equal(both, known)
    assert not np.allclose(both, FreeRun(three_bodies(), log).outputs())


@pytest.mark.parametrize("hold", ["zoh", "foh", "band_limited"])
@pytest.mark.parametrize("effects", [(), (HARDENING,)], ids=["linear", "law"])
def test_windows_that_start_where_the_last_ended_are_one_run(effects, hold, signals, log):
    model = three_bodies().with_holds({"hammer": hold})
    compiled = model.with_effects(effects).compile()
    whole = Integrator(compiled, RATE_HZ, tolerance=1e-9).run(signals)
    starts = whole.states[:, [0, 700]].T
    run = FreeRun(model, log, windows=((0, 700), (700, 2000)))
    found = run.outputs(effects=effects, initial=starts)
    # Laws are marched through in an eighth of a sample, with an error of order 2: (150 Hz/8192 Hz)^2 2 pi^2/3.
    allowed = 3e-3 if effects else 1e-9
    assert np.abs(found - whole.outputs[[2, 0]]).max() < allowed * np.abs(whole.outputs).max()


@pytest.mark.parametrize("offset_s", [-5.3e-3, 2.7e-3])
def test_a_clock_that_is_off_reads_across_windows(offset_s, signals, log):
    offset = attached("time_offset", "a2", {"offset": offset_s})
    whole = Integrator(three_bodies().compile(), RATE_HZ, tolerance=1e-9).run(signals)
    run = FreeRun(three_bodies(), log, windows=((0, 700), (700, 2000)))
    starts = whole.states[:, [0, 700]].T
    found = run.outputs(effects=[offset], initial=starts)
    known = FreeRun(three_bodies().with_effects([offset]), log, windows=run.windows).outputs(initial=starts)
    np.testing.assert_array_equal(found, known)
    shifted = Integrator(three_bodies().with_effects([offset]).compile(), RATE_HZ, tolerance=1e-9).run(signals)
    # Between samples a cubic spline is good to three per cent at a seventh of the sample rate; beyond the log's ends
    # nothing is known.
    error = (found - shifted.outputs[[2, 0]])[:, 6:-6]
    assert np.abs(error).max() < 0.04 * np.abs(whole.outputs).max()


def test_laws_in_windows_know_the_time_of_the_log(log):
    drift = attached("varying_stiffness", "j1", {"relative_change": 0.3, "time": 1.0})
    run = FreeRun(three_bodies(), log, windows=((0, 1000), (1000, 2000)))
    compiled = three_bodies().with_effects([drift]).compile()
    whole = Integrator(compiled, RATE_HZ).run(log.inputs)
    found = run.outputs(effects=[drift], initial=whole.states[:, [0, 1000]].T)
    assert np.abs(found - whole.outputs[[2, 0]]).max() < 5e-3 * np.abs(whole.outputs).max()


def test_motion_is_that_of_the_joint(signals, log):
    run = FreeRun(three_bodies(), log)
    motion = run.motion(effects=[FRICTION], site="j1")
    compiled = three_bodies().with_effects([FRICTION]).compile()
    whole = Integrator(compiled, RATE_HZ, tolerance=1e-6).run(signals)
    np.testing.assert_allclose(motion.displacement, whole.states[1] - whole.states[0], atol=1e-15)
    np.testing.assert_allclose(motion.velocity, whole.states[4] - whole.states[3], atol=1e-12)
    np.testing.assert_allclose(motion.force, whole.force[0], atol=1e-12)
    assert np.abs(motion.force).max() == pytest.approx(8.0, rel=1e-6)
    # Where no law acts there is a motion, and no force.
    quiet = run.motion(effects=[FRICTION], site="j0")
    np.testing.assert_allclose(quiet.displacement, whole.states[0], atol=1e-15)
    assert not quiet.force.any()


def test_the_same_run_twice_is_the_same(log):
    run = FreeRun(three_bodies(), log)
    first = run.outputs(effects=[FRICTION])
    run.outputs(np.ones(9))
    np.testing.assert_array_equal(run.outputs(effects=[FRICTION]), first)
    np.testing.assert_array_equal(FreeRun(three_bodies(), log).outputs(effects=[FRICTION]), first)


def test_mistakes_are_named(log):
    with pytest.raises(ModelError, match="no output 'a9'"):
        FreeRun(three_bodies(), replace(log, output_names=("a9", "a0")))
    with pytest.raises(ModelError, match="the model takes hammer"):
        FreeRun(three_bodies(), replace(log, input_names=("shaker",)))
    with pytest.raises(ModelError, match="must begin at sample 700"):
        FreeRun(three_bodies(), log, windows=((0, 700), (800, 2000)))
    with pytest.raises(ModelError, match="cover all of it"):
        FreeRun(three_bodies(), log, windows=((0, 700),))
    with pytest.raises(ModelError, match="initial state has shape"):
        FreeRun(three_bodies(), log).outputs(initial=np.zeros(5))
