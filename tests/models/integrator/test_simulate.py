"""From excitations and logs to recorded channels."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameters
from chladni.models.integrator.integrator import integrate
from chladni.models.integrator.simulate import simulate
from chladni.signals.channel import Channel
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries
from tests.models.integrator.systems import compiled_structure, cubic, law, oscillator, plain_model


@dataclass(frozen=True)
class Given:
    """A model that was compiled before."""

    compiled: CompiledModel
    name: str = "given"
    kind: str = "structure"
    parameters: Parameters = field(default_factory=lambda: Parameters(()))
    effects: tuple = ()
    word: tuple[str, ...] = ()

    def compile(self):
        return self.compiled

    def flags(self, _simulation):
        return self.word


class Ramp:
    def samples(self, count, sample_rate_hz, _rng):
        return np.arange(count) / sample_rate_hz


class Noise:
    def samples(self, count, _sample_rate_hz, rng):
        return rng.standard_normal(count)


def one_body(**changes):
    return Given(compiled_structure(oscillator(), force_at="body", laws=(law(0, cubic, 1e6),)), **changes)


def series(values, name="/force", unit="N", valid=None):
    return TimeSeries(
        values=np.atleast_2d(values), sample_rate_hz=200.0, start_time_ns=7, valid=valid,
        channels=(Channel(name=name, unit=unit),),
    )  # fmt: skip


@pytest.mark.parametrize("name", ["/force", "force"])
def test_a_log_drives_the_input_by_channel_or_by_name(name):
    model, signals = one_body(), np.sin(np.arange(100.0))
    found = simulate(model, series(signals, name))
    truth = integrate(model.compiled, signals[None], 200.0)
    np.testing.assert_array_equal(found.outputs.values, truth.outputs)
    np.testing.assert_array_equal(found.states, truth.states)
    assert found.outputs.start_time_ns == found.inputs.start_time_ns == 7
    assert found.outputs.sample_rate_hz == 200.0
    assert found.outputs.channels[0].name == "displacement_body"
    assert [channel.unit for channel in found.outputs.channels] == ["m", "m/s", "m/s^2"]
    assert found.inputs.channels[0].name == "/force"
    assert found.inputs.channels[0].role == "reference"
    assert found.flags == ()
    motion = found.motion("joint")
    np.testing.assert_allclose(motion.force, 1e6 * motion.displacement**3, rtol=1e-14)


def test_part_of_a_log_is_simulated():
    found = simulate(one_body(), series(np.ones(100)), duration_s=0.25)
    assert found.outputs.samples == 50


def test_excitations_are_sampled_by_name_and_seed():
    model = Given(plain_model([[0.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]]), word=("far out",))
    found = simulate(model, {"u1": Ramp()}, duration_s=0.1, sample_rate_hz=100.0)
    times = np.arange(10) / 100
    np.testing.assert_allclose(found.states[0], times**2, atol=1e-15)
    assert found.flags == ("not driven, taken as zero: u0", "far out")
    both = simulate(model, {"u0": Noise(), "u1": Noise()}, duration_s=0.1, sample_rate_hz=100.0, seed=4)
    one = simulate(model, {"u1": Noise()}, duration_s=0.1, sample_rate_hz=100.0, seed=4)
    np.testing.assert_array_equal(both.inputs.values[1], one.inputs.values[1])
    assert not np.array_equal(both.inputs.values[0], both.inputs.values[1])


def test_one_excitation_drives_the_first_input():
    found = simulate(one_body(), Ramp(), duration_s=0.1, sample_rate_hz=100.0)
    np.testing.assert_array_equal(found.inputs.values[0], np.arange(10) / 100)
    assert found.refined_steps >= 0


@pytest.mark.parametrize(
    ("excitation", "options", "words"),
    [
        (series(np.ones(10), "/other"), {}, "it listens to /force; the series has /other"),
        (series(np.ones(10), unit="V"), {}, "is in V, input 'force' takes N"),
        (series([1.0, np.nan, 1.0]), {}, "1 of 3 samples are missing, the first at 0.005 s"),
        (series(np.ones(3), valid=np.array([[True, True, False]])), {}, "the first at 0.01 s"),
        (series(np.ones(10)), {"sample_rate_hz": 100.0}, "the series has 200 Hz; resample it first"),
        (series(np.ones(10)), {"duration_s": 1.0}, "the series is 0.05 s long"),
        (Ramp(), {}, "give duration_s and sample_rate_hz"),
        (Ramp(), {"duration_s": 0.001, "sample_rate_hz": 10.0}, "hold no sample"),
        (Ramp(), {"duration_s": -1.0, "sample_rate_hz": 10.0}, "duration_s = -1.0 must be finite and positive"),
        ({"nowhere": Ramp()}, {"duration_s": 1.0, "sample_rate_hz": 10.0}, "no input 'nowhere'; inputs: force"),
        (Ramp(), {"duration_s": 1e9, "sample_rate_hz": 1e4}, "simulate less time or a lower rate"),
    ],
)
def test_what_does_not_fit_is_told(excitation, options, words):
    with pytest.raises(ModelError, match=words):
        simulate(one_body(), excitation, **options)


def test_an_excitation_must_give_as_many_samples_as_asked():
    class Short:
        def samples(self, count, _sample_rate_hz, _rng):
            return np.zeros(count - 1)

    with pytest.raises(ModelError, match=r"gave shape \(9,\), \(10,\) was expected"):
        simulate(one_body(), Short(), duration_s=0.1, sample_rate_hz=100.0)


def test_a_model_without_inputs_can_not_be_excited():
    model = Given(plain_model([[0.0]], np.zeros((1, 0)), [[1.0]], np.zeros((1, 0))))
    with pytest.raises(ModelError, match="no input to excite"):
        simulate(model, Ramp(), duration_s=0.1, sample_rate_hz=100.0)
