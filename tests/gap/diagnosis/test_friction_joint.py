"""A friction joint slips little by little, and its loops close (Masing): that is hysteresis."""

import numpy as np
import pytest
from scipy.linalg import expm

import chladni
from chladni.gap.calibration import DETAILS, OPEN
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.records.measurement import Measurement
from chladni.models.effects.catalogue import CATALOGUE
from tests.gap.arm import RATE_HZ, all_but, arm, low_passed

#: Steps between samples; sliders in parallel, whose yields are far apart.
PARTS = 16
STIFFNESS, YIELDS = 1.2e5, np.geomspace(3e-5, 1.5e-3, 12)


def jointed(seconds: float, noise: float, seed: int) -> Measurement:
    """An arm with sliders at its elbow; its linear part exact between steps, each slider a spring that is cut off."""
    rng = np.random.default_rng(seed)
    model = arm()
    values = {name: one.value * np.exp(0.01 * rng.standard_normal()) for name, one in model.parameters.items()}
    compiled = model.with_values(values).compile()
    elbow = compiled.port_index("elbow", "joint")
    states = len(compiled.states)
    whole = np.zeros((states + 2, states + 2))
    whole[:states] = np.hstack([compiled.a, compiled.b[:, :1], compiled.g[:, elbow : elbow + 1]])
    step = expm(whole / RATE_HZ / PARTS)[:states]
    force = low_passed(400.0 * rng.standard_normal(round(seconds * RATE_HZ)))
    stretched, state, before, way = np.zeros(YIELDS.size), np.zeros(states), 0.0, 0.0
    outputs = np.zeros((3, force.size))
    for sample in range(force.size):
        for part in range(PARTS):
            now = float(compiled.displacement_state[elbow] @ state)
            stretched = np.clip(stretched + now - way, -YIELDS, YIELDS)
            way, resisting = now, STIFFNESS * stretched.mean()
            if part == 0:
                acting = np.array([force[sample], resisting])
                outputs[:, sample] = (
                    compiled.c @ state + compiled.d[:, 0] * acting[0] + compiled.h[:, elbow] * acting[1]
                )
            after = force[min(sample + 1, force.size - 1)]
            pushed = force[sample] + (after - force[sample]) * (part + 0.5) / PARTS
            state = step @ np.concatenate([state, [pushed, 1.5 * resisting - 0.5 * before]])
            before = resisting
    return Measurement(
        log="jointed", sample_rate_hz=RATE_HZ, inputs=force[None],
        outputs=outputs + noise * outputs.std(axis=1, keepdims=True) * rng.standard_normal(outputs.shape),
        input_names=("shaker",), output_names=tuple(one.name for one in model.outputs), output_units=("m/s^2",) * 3,
    )  # fmt: skip


@pytest.mark.nightly
def test_sliders_leave_a_third_of_what_one_element_leaves() -> None:
    study = study_of(arm(), jointed(4.0, 0.005, 1), leave_out=frozenset(CATALOGUE) - {"hysteresis"}, own={})
    values = {"force": STIFFNESS * YIELDS.mean(), "yield": YIELDS.mean()}
    begun = [
        hypothesis_of((chladni.attached("hysteresis", "elbow", values, variant=one),), study.location.tuned.z)
        for one in ("bouc_wen", "sliders")
    ]
    one, six = study.contest.enter_all(begun)
    assert six.chi < one.chi / 3
    assert six.log_evidence > one.log_evidence
    # Both are the right word and leave usual details of its force: few numbers, however far over the noise.
    assert max(one.left.details, six.left.details) < OPEN
    beyond = [each.left.along - each.left.along_expected for each in (one, six)]
    gained = six.left.log_likelihood - one.left.log_likelihood
    assert gained == pytest.approx(DETAILS * np.log(beyond[0] / beyond[1]), abs=1.0)


@pytest.mark.nightly
def test_an_elbow_of_sliders_is_hysteresis() -> None:
    found = diagnose(
        arm(), [jointed(4.0, 0.005, 1)], leave_out=all_but("hysteresis", "stribeck_friction", "extra_mode")
    )
    assert [(one.effect, one.site) for one in found.causes] == [("hysteresis", "elbow")]
    assert found.causes[0].variant == "sliders"
    assert found.causes[0].probability > 0.6
