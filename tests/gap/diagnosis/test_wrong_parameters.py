"""A parameter far outside of its tolerance, alone and beside something that the model lacks."""

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.gap.made_log import RATE_HZ, band_noise, chain, measured, three_bodies

DAMPING, TOLD = 400.0, 800.0


def diagnosed(*effects: AttachedEffect) -> Diagnosis:
    """A body on a damper that the model has twice as strong, 14 sigma away."""
    real = chain([2.0], [2e5], [DAMPING]).with_effects(effects)
    force = band_noise(6000, rms=300.0)
    channel = Channel(name="hammer", unit="N", role="reference")
    driven = TimeSeries(values=force, sample_rate_hz=RATE_HZ, channels=(channel,))
    outputs = chladni.simulate(real, driven).outputs.values
    noise = 0.003 * outputs.std() * np.random.default_rng(0).standard_normal(outputs.shape)
    log = Measurement(
        log="log.mcap", sample_rate_hz=RATE_HZ, inputs=force, outputs=outputs + noise,
        input_names=("hammer",), output_names=("a0",), output_units=("m/s^2",),
    )  # fmt: skip
    return diagnose(chain([2.0], [2e5], [TOLD]), [log])


@pytest.mark.nightly
def test_alone_it_is_named() -> None:
    found = diagnosed()
    assert found.verdict == "parameters"
    assert [(one.effect, one.site) for one in found.causes] == [("parameter", "j0.damping")]
    assert found.tuned_parameters["j0.damping"].value == pytest.approx(DAMPING, rel=0.01)


@pytest.mark.nightly
def test_a_slip_of_a_factor_of_ten_is_named_and_no_effect_is() -> None:
    right = three_bodies()
    model = right.with_values({"j1.stiffness": 10.0 * right.parameters["j1.stiffness"].value})
    log, _ = measured(right, band_noise(3000, rms=150.0))
    found = diagnose(model, [log])
    assert found.verdict == "parameters"
    assert [(one.effect, one.site) for one in found.causes] == [("parameter", "j1.stiffness")]
    assert found.tuned_parameters["j1.stiffness"].value == pytest.approx(6e5, rel=0.01)


@pytest.mark.nightly
def test_beside_friction_both_are_named() -> None:
    found = diagnosed(chladni.attached("coulomb_friction", "j0", {"force": 8.0}))
    assert found.verdict == "effect"
    assert {(one.effect, one.site) for one in found.causes} == {
        ("parameter", "j0.damping"), ("coulomb_friction", "j0")
    }  # fmt: skip
    assert found.tuned_parameters["j0.damping"].value == pytest.approx(DAMPING, rel=0.02)
