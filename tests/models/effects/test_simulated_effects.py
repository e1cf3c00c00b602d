"""Effects in simulations: exact ones against their closed form, laws against SciPy on the same law in Python."""

import runpy
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.integrator.integrator import integrate
from chladni.signals.arrays import Real
from tests.models.effects.own_effect import CUBIC_DAMPING
from tests.models.effects.small_models import one_body, with_loop
from tests.models.structures.made_models import tree

Shape = Callable[[Real], Real]
RATE_HZ = 1000.0
COUNT = 300
TIMES_S = np.arange(COUNT) / RATE_HZ


def _push(seed: int = 0, size: float = 40.0) -> Real:
    """A force (or a reference) without energy near the Nyquist frequency, starting from zero."""
    rng = np.random.default_rng(seed)
    tones = [
        a * np.sin(2 * np.pi * f * TIMES_S + p) - a * np.sin(p)
        for f, a, p in zip(rng.uniform(1, 25, 6), rng.uniform(0.3, 1, 6), rng.uniform(0, 6, 6), strict=True)
    ]
    return size / 3 * np.sum(tones, axis=0)


def _linear(compiled: CompiledModel, signal: Real) -> Real:
    """Outputs of the linear equations by SciPy, for an input that joins its samples by straight lines."""
    _, found, _ = lsim((compiled.a, compiled.b, compiled.c, compiled.d), signal, TIMES_S)
    return found.T


class _Oracle:
    """A compiled model with one input and laws, written for SciPy: laws as Python, port after port."""

    def __init__(self, compiled: CompiledModel, signal: Real) -> None:
        self._model, self._signal = compiled, signal
        self._rise = np.append(np.diff(signal), 0.0)
        self._n = len(compiled.states)
        self._order = _in_order(compiled)
        starts = self._n + np.cumsum([0, *(len(law.state) for law in compiled.laws)])
        self._places = list(zip(compiled.laws, starts[:-1], starts[1:], strict=True))

    def input(self, t: float) -> float:
        """The signal at a time, straight between samples."""
        place = min(int(t * RATE_HZ + 1e-9), COUNT - 1)
        return float(self._signal[place] + self._rise[place] * (t * RATE_HZ - place))

    def forces(self, t: float, x: Real, rates: Real) -> Real:
        """Forces at all ports; each port's motion needs forces of ports before it only."""
        model, z, u = self._model, x[: self._n], self.input(t)
        f = np.zeros(len(model.ports))
        for port in self._order:
            d = model.displacement_state[port] @ z + model.displacement_column[port, 0] * u
            d += model.displacement_port[port] @ f
            s = model.velocity_state[port] @ z + model.velocity_column[port, 0] * u
            for law, start, stop in self._places:
                if law.port == port:
                    found = [0.0] * (stop - start)
                    f[port] += law.function(float(d), float(s), t, law.parameters, x[start:stop].tolist(), found)
                    rates[start:stop] = found
        return f

    def rates(self, t: float, x: Real) -> Real:
        """Rates of all states."""
        rates = np.zeros_like(x)
        f = self.forces(t, x, rates)
        model = self._model
        rates[: self._n] = model.a @ x[: self._n] + model.b[:, 0] * self.input(t) + model.g @ f
        return rates

    def outputs(self) -> Real:
        """``[output, sample]``."""
        model = self._model
        start = np.concatenate([np.zeros(self._n), *(law.state for law in model.laws)])
        span = (0.0, float(TIMES_S[-1]))
        x = solve_ivp(
            self.rates, span, start, method="LSODA", t_eval=TIMES_S, rtol=1e-8, atol=1e-11, max_step=5e-3
        ).y.T
        f = np.array([self.forces(t, one, np.zeros_like(one)) for t, one in zip(TIMES_S, x, strict=True)])
        return (x[:, : self._n] @ model.c.T + np.outer(self._signal, model.d[:, 0]) + f @ model.h.T).T


def _by_scipy(compiled: CompiledModel, signal: Real) -> Real:
    return _Oracle(compiled, signal).outputs()


def _in_order(compiled: CompiledModel) -> list[int]:
    depends = compiled.displacement_port != 0
    order: list[int] = []
    waiting = sorted({law.port for law in compiled.laws})
    while waiting:
        ready = next(port for port in waiting if not depends[port, waiting].any())
        order.append(ready)
        waiting.remove(ready)
    return order


def _error(found: Real, wanted: Real) -> float:
    """Largest RMS error of an output over its RMS."""
    return float(np.max(np.sqrt(np.mean((found - wanted) ** 2, axis=1) / np.mean(wanted**2, axis=1))))


SMOOTH, SWITCHING = 1e-5, 1e-4
STRIBECK = {"coulomb": 4.0, "static": 6.0, "speed": 0.1}
CHANGE = {"relative_change": 0.6, "time": 0.15, "rise": 0.1}
JOINT_LAWS = [
    (attached("coulomb_friction", "spring", {"force": 5.0, "offset": 1.0, "creep_speed": 0.01}), SMOOTH),
    (attached("coulomb_friction", "spring", {"force": 5.0, "presliding": 2e-4}, variant="bristle"), SWITCHING),
    (attached("stribeck_friction", "spring", {**STRIBECK, "creep_speed": 0.01}), SMOOTH),
    (attached("stribeck_friction", "spring", {**STRIBECK, "presliding": 5e-4}, variant="bristle"), SWITCHING),
    (attached("quadratic_damping", "spring", {"coefficient": 20.0}), SMOOTH),
    (attached("hardening_stiffness", "spring", {"cubic": 2e5}), SMOOTH),
    (attached("softening_stiffness", "spring", {"cubic": -1e5}), SMOOTH),
    (attached("backlash", "spring", {"gap": 0.02}), SWITCHING),
    (attached("backlash", "spring", {"gap": 0.02}, variant="contact_damping"), SWITCHING),
    (attached("one_sided_stop", "spring", {"stiffness": 5e3, "clearance": 0.01}), SWITCHING),
    (
        attached(
            "one_sided_stop", "spring", {"stiffness": 5e3, "clearance": -0.01, "side": -1, "depth": 0.01},
            variant="hertz_damper",
        ),
        SWITCHING,
    ),
    (attached("hysteresis", "spring", {"force": 8.0, "yield": 0.005, "shape": 2.0}), SWITCHING),
    (
        attached(
            "hysteresis", "spring", {"force": 8.0, "yield": 0.005, "shape": 2.0, "slip_speed": 0.1, "loop": 1.5},
            variant="creeping",
        ),
        SWITCHING,
    ),
    (
        attached(
            "hysteresis", "spring", {"force": 8.0, "yield": 0.005, "shape": 2.0, "spread": 2.0}, variant="sliders"
        ),
        SWITCHING,
    ),
    (attached("varying_stiffness", "spring", {"relative_change": 0.6, "time": 0.2}), SMOOTH),
    (attached("varying_stiffness", "spring", CHANGE, variant="step"), SMOOTH),
    (attached("ripple", "spring", {"amplitude": 6.0, "period": 0.02}), SMOOTH),
    (attached("ripple", "motor", {"amplitude": 6.0, "period": 0.02, "phase": 1.0}), SMOOTH),
    (attached("tonal_disturbance", "mass", {"amplitude": 6.0, "frequency": 33.0}), SMOOTH),
    (attached(CUBIC_DAMPING, "spring", {"coefficient": 20.0}), SMOOTH),
]  # fmt: skip


@pytest.mark.parametrize(("effect", "tolerance"), JOINT_LAWS, ids=lambda one: _name(one))
def test_laws_of_force_agree_with_scipy(effect: AttachedEffect, tolerance: float) -> None:
    compiled = effect.attach(one_body())
    found = integrate(compiled, _push()[None], RATE_HZ).outputs
    assert _error(found, _by_scipy(compiled, _push())) < tolerance
    # The effect is seen, or the comparison would be one of linear models.
    assert _error(found, _linear(one_body(), _push())) > 100 * tolerance


LOOP_LAWS = [
    (attached("saturation", "motor", {"limit": 15.0}), SWITCHING),
    (attached("saturation", "motor", {"limit": 15.0}, variant="smooth"), SMOOTH),
    (attached("saturation", "motor", {"limit": 15.0, "knee": 0.3}, variant="rounded"), SMOOTH),
    (attached("dead_zone", "motor", {"width": 6.0}), SWITCHING),
    (attached("rate_limit", "motor", {"rate": 800.0}), SWITCHING),
    (attached("clipping", "place", {"limit": 0.01}), SWITCHING),
    (attached("clipping", "place", {"limit": 0.01, "knee": 0.2}, variant="rounded"), SMOOTH),
    (attached("quantization", "place", {"step": 0.01}), SWITCHING),
    (attached("tonal_disturbance", "place", {"amplitude": 0.01, "frequency": 33.0}), SMOOTH),
]


@pytest.mark.parametrize(("effect", "tolerance"), LOOP_LAWS, ids=lambda one: _name(one))
def test_laws_inside_a_loop_agree_with_scipy(effect: AttachedEffect, tolerance: float) -> None:
    if effect.site == "motor":
        compiled = effect.attach(with_loop(one_body()))
    else:
        compiled = with_loop(effect.attach(one_body(), in_loop=True))
    reference = _push(size=0.08)
    found = integrate(compiled, reference[None], RATE_HZ).outputs
    assert _error(found, _by_scipy(compiled, reference)) < tolerance
    assert _error(found, _linear(with_loop(one_body()), reference)) > 100 * tolerance


def test_several_effects_in_a_row_inside_a_loop_agree_with_scipy() -> None:
    compiled = attached("clipping", "place", {"limit": 0.015}).attach(one_body(), in_loop=True)
    compiled = attached("mounting_resonance", "place", {"frequency": 60.0, "damping_ratio": 0.3}).attach(compiled)
    compiled = with_loop(attached("quadratic_damping", "spring", {"coefficient": 20.0}).attach(compiled))
    for effect in (
        attached("dead_zone", "motor", {"width": 4.0}),
        attached("lag", "motor", {"time_constant": 0.01}),
        attached("saturation", "motor", {"limit": 10.0}, variant="smooth"),
        attached("gain_error", "motor", {"gain": 1.3}),
    ):
        compiled = effect.attach(compiled)
    assert len(compiled.laws) == 4
    reference = _push(size=0.08)
    found = integrate(compiled, reference[None], RATE_HZ).outputs
    assert _error(found, _by_scipy(compiled, reference)) < SWITCHING


@pytest.mark.parametrize(
    ("word", "values", "variant", "shape"),
    [
        ("saturation", {"limit": 15.0}, "clipped", lambda u: np.clip(u, -15, 15)),
        ("saturation", {"limit": 15.0}, "smooth", lambda u: 15 * np.tanh(u / 15)),
        ("dead_zone", {"width": 6.0}, "overlap", lambda u: u - np.clip(u, -6, 6)),
        ("gain_error", {"gain": -0.7}, "factor", lambda u: -0.7 * u),
    ],
)
def test_shapes_of_an_inputs_samples_are_exact(
    word: str, values: Mapping[str, float], variant: str, shape: Shape
) -> None:
    compiled = attached(word, "motor", values, variant=variant).attach(one_body())
    found = integrate(compiled, _push()[None], RATE_HZ).outputs
    wanted = integrate(one_body(), shape(_push())[None], RATE_HZ).outputs
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize(
    ("word", "values", "shape"),
    [
        ("clipping", {"limit": 8.0}, lambda y: np.clip(y, -8, 8)),
        ("quantization", {"step": 0.5}, lambda y: 0.5 * np.round(y / 0.5)),
        ("gain_error", {"gain": 1.2}, lambda y: 1.2 * y),
        (
            "tonal_disturbance",
            {"amplitude": 3.0, "frequency": 50.0, "phase": 0.3},
            lambda y: y + 3 * np.sin(100 * np.pi * TIMES_S + 0.3),
        ),
    ],
)
def test_shapes_of_an_outputs_samples_are_exact(word: str, values: Mapping[str, float], shape: Shape) -> None:
    before = integrate(one_body(), _push()[None], RATE_HZ).outputs
    after = integrate(attached(word, "acc", values).attach(one_body()), _push()[None], RATE_HZ).outputs
    np.testing.assert_allclose(after[0], shape(before[0]), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(after[1:], before[1:])


def test_a_share_of_another_direction_is_exact() -> None:
    before = integrate(one_body(), _push()[None], RATE_HZ).outputs
    compiled = attached("cross_axis", "acc", {"coefficient": 0.3}, source="speed").attach(one_body())
    after = integrate(compiled, _push()[None], RATE_HZ).outputs
    np.testing.assert_allclose(after[0], before[0] + 0.3 * before[1], rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("delay_s", [0.012, 0.0123])
def test_a_delay_is_exact(delay_s: float) -> None:
    """A late input is the same signal, whose straight lines have their corners between the samples."""
    compiled = attached("delay", "motor", {"delay": delay_s}).attach(one_body())
    found = integrate(compiled, _push()[None], RATE_HZ).outputs
    fine_s = np.arange(10 * COUNT) / (10 * RATE_HZ)
    late = np.interp(fine_s - delay_s, TIMES_S, _push(), left=0.0)
    fine = one_body()
    _, wanted, _ = lsim((fine.a, fine.b, fine.c, fine.d), late, fine_s)
    np.testing.assert_allclose(found, wanted[::10].T, atol=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize("offset_s", [0.02, -0.013, 0.0075])
def test_a_time_offset_is_exact(offset_s: float) -> None:
    compiled = attached("time_offset", "speed", {"offset": offset_s}).attach(one_body())
    found = integrate(compiled, _push()[None], RATE_HZ).outputs
    fine_s = np.arange(2 * COUNT) / (2 * RATE_HZ)
    _, fine, _ = lsim(
        (one_body().a, one_body().b, one_body().c, one_body().d), np.interp(fine_s, TIMES_S, _push()), fine_s
    )
    places = np.round((TIMES_S - offset_s) * 2 * RATE_HZ).astype(int)
    known = (places >= 0) & (places < fine_s.size)
    np.testing.assert_allclose(found[1][known], fine[places[known], 1], atol=1e-9 * np.abs(fine[:, 1]).max())


def test_a_delay_inside_a_loop_follows_its_frequency_response() -> None:
    compiled = attached("delay", "motor", {"delay": 0.0105}).attach(with_loop(one_body(damping=40.0), gain=150.0))
    frequency_hz, count = 5.0, 3000
    times_s = np.arange(count) / RATE_HZ
    found = integrate(compiled, 0.1 * np.sin(2 * np.pi * frequency_hz * times_s)[None], RATE_HZ).outputs[2]
    # The last second holds five whole periods; what started has died away by exp(-15). Straight lines in place of the
    # sine make it 1 - (pi f/rate)^2/3 = 1 - 8e-5 as large.
    tone = 2j * np.mean(found[-1000:] * np.exp(-2j * np.pi * frequency_hz * times_s[-1000:]))
    wanted = 0.1 * compiled.frequency_response(np.array([frequency_hz]))[2, 0, 0]
    assert tone == pytest.approx(wanted, rel=2e-4)


@pytest.mark.parametrize(
    "effect",
    [
        attached("added_mass", "mass", {"mass": 0.6}),
        attached("extra_mode", "mass", {"mass": 0.3, "frequency": 6.0, "damping_ratio": 0.05}),
        attached("lag", "motor", {"time_constant": 0.02}),
        attached("lag", "motor", {"time_constant": 0.02, "damping_ratio": 0.4}, variant="second_order"),
        attached("mounting_resonance", "acc", {"frequency": 60.0, "damping_ratio": 0.1}),
        attached("ac_coupling", "acc", {"corner": 1.5}),
    ],
    ids=lambda one: _name(one),
)
def test_linear_effects_are_exact(effect: AttachedEffect) -> None:
    compiled = effect.attach(one_body())
    found = integrate(compiled, _push()[None], RATE_HZ).outputs
    wanted = _linear(compiled, _push())
    np.testing.assert_allclose(found, wanted, atol=1e-10 * np.abs(wanted).max())


def test_a_floor_that_shakes_is_an_input_that_nobody_measured() -> None:
    model = tree()
    compiled = attached("base_vibration", "ground", {"level": 0.5, "band": 80.0, "seed": 5}).attach(model.compile())
    silent = np.zeros((3, COUNT))
    found = integrate(compiled, silent, RATE_HZ).outputs
    measured = silent.copy()
    measured[2] = compiled.generated[0].samples(TIMES_S)
    np.testing.assert_allclose(
        found, integrate(model.compile(), measured, RATE_HZ).outputs, rtol=1e-9, atol=1e-9 * np.abs(found).max()
    )
    assert np.std(found[0]) > 0.1


def test_backlash_lets_the_body_drift_through_the_gap() -> None:
    """Free flight: from rest in the middle, undamped, a constant speed until the far side is met."""
    plant = one_body(damping=0.0)
    compiled = attached("backlash", "spring", {"gap": 0.1}).attach(plant)
    found = integrate(compiled, np.zeros((1, COUNT)), RATE_HZ, initial={"v": 0.5}).outputs
    inside = TIMES_S < 0.1
    np.testing.assert_allclose(found[2][inside], 0.5 * TIMES_S[inside], atol=1e-9)
    # Then half a period of the spring: the stretch is v/omega sin(omega t).
    stretch = 0.5 / 20.0 * np.sin(20.0 * (TIMES_S - 0.1))
    pressed = (stretch > 0) & (TIMES_S > 0.1)
    np.testing.assert_allclose(found[2][pressed], 0.05 + stretch[pressed], atol=1e-7)


def test_friction_takes_four_f_over_k_from_the_amplitude_in_each_period() -> None:
    plant = one_body(damping=0.0)
    compiled = attached("coulomb_friction", "spring", {"force": 2.0, "creep_speed": 1e-4}).attach(plant)
    count = 1000
    found = integrate(compiled, np.zeros((1, count)), RATE_HZ, initial={"x": 0.1}).outputs[2]
    # Between turning points a cosine about -+F/k: the envelope is a straight line, the period that of the spring.
    half = np.floor(np.arange(count) / RATE_HZ * 20.0 / np.pi)
    middle = 2.0 / 800.0 * (-1.0) ** half
    amplitude = 0.1 - 2.0 / 800.0 * (2 * half + 1)
    wanted = middle + amplitude * (-1.0) ** half * np.cos(20.0 * np.arange(count) / RATE_HZ - np.pi * half)
    # At a creep speed of 5e-5 of the largest speed, tanh falls short of the sign for a moment at each reversal.
    np.testing.assert_allclose(found, wanted, atol=2e-5)


def _name(one: object) -> str | None:
    return f"{one.effect}-{one.variant}" if isinstance(one, AttachedEffect) else None


def test_the_oracle_is_exact_on_a_linear_model() -> None:
    law = attached("hardening_stiffness", "spring", {"cubic": 0.0}).attach(one_body())
    np.testing.assert_allclose(
        _by_scipy(replace(law), _push()), _linear(one_body(), _push()), atol=1e-6 * np.abs(_push()).max()
    )


def test_the_example_of_the_user_page_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).parents[3] / "docs" / "effects.md").read_text(encoding="utf-8")
    example = tmp_path / "example.py"
    example.write_text(page.split("```python\n")[1].split("```")[0], encoding="utf-8")
    runpy.run_path(str(example))
    assert 8.0 < float(capsys.readouterr().out) <= 8.1
