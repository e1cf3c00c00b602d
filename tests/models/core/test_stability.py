from dataclasses import replace

import numpy as np
import pytest
from scipy.special import lambertw

from chladni.models.core.compiled_model import CompiledModel, DelayLine
from chladni.models.core.port import Port
from chladni.models.core.stability import growing_poles


def model(a, *, delays=(), g=None, seen=None, direct=None):
    """States alone, or with one port per dead time that sees `seen` x + `direct` f and drives the states by `g` f."""
    n, q, none = len(a), len(delays), np.zeros
    return CompiledModel(
        a=np.array(a, dtype=float).reshape(n, n), b=none((n, 0)), c=none((0, n)), d=none((0, 0)),
        g=none((n, q)) if g is None else np.array(g, dtype=float), h=none((0, q)),
        displacement_state=none((q, n)) if seen is None else np.array(seen, dtype=float),
        displacement_column=none((q, 0)),
        displacement_port=none((q, q)) if direct is None else np.array(direct, dtype=float),
        velocity_state=none((q, n)), velocity_column=none((q, 0)), velocity_port=none((q, q)),
        inputs=(), outputs=(), states=tuple(f"x{k}" for k in range(n)),
        ports=tuple(Port(name=f"late{k}", kind="output") for k in range(q)),
        delays=tuple(DelayLine(port=k, delay_s=delay) for k, delay in enumerate(delays)),
    )  # fmt: skip


def late_integrator(gain, delay_s):
    """``x' = -gain x(t - delay)``: the undelayed signal is in A, the port adds the difference."""
    return model([[-gain]], delays=(delay_s,), g=[[-gain]], seen=[[1.0]])


@pytest.mark.parametrize("delay_s", [1e-6, 0.3, 2e3])
@pytest.mark.parametrize("share", [0.5, 0.99, 1.01, 1.5, 3.0])
def test_an_integrator_with_dead_time_is_unstable_beyond_half_pi(delay_s, share):
    gain = share * np.pi / 2 / delay_s
    found = growing_poles(late_integrator(gain, delay_s))
    assert bool(found.size) == (share > 1)
    if share > 1:
        # s = -gain e^(-s tau), so s tau = W(-gain tau).
        expected = lambertw(-gain * delay_s) / delay_s
        nearest = found[np.argmin(np.abs(found - expected))]
        assert nearest == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("gain", "growing"), [(0.9, False), (-0.9, False), (-1.1, True), (1.1, True)])
def test_an_echo_dies_out_when_it_comes_back_smaller(gain, growing):
    # y = gain y(t - tau): with f = y_late - y at the port, y = gain/(1 - gain) f.
    echo = model(np.zeros((0, 0)), delays=(0.1,), direct=[[gain / (1 - gain)]])
    assert bool(growing_poles(echo).size) == growing


def test_two_dead_times_in_a_row_are_as_long_as_both():
    # x' = -k z_late, z = x_late: what the first port hands on, the second sees.
    def row(gain):
        return model([[-gain]], delays=(0.1, 0.2), g=[[-gain, -gain]], seen=[[1.0], [1.0]], direct=[[0, 0], [1, 0]])

    limit = np.pi / 2 / 0.3
    assert not growing_poles(row(0.99 * limit)).size
    assert growing_poles(row(1.01 * limit)).size


def test_integrators_are_not_told_as_unstable():
    chain = np.eye(4, k=1)
    rng = np.random.default_rng(1)
    turn = rng.normal(size=(4, 4))
    # Rounding splits a fourfold pole at 0 by eps^(1/4).
    assert not growing_poles(model(chain)).size
    assert not growing_poles(model(turn @ chain @ np.linalg.inv(turn))).size


def test_slow_growth_beside_fast_poles_is_seen():
    found = growing_poles(model([[1e-4, 3.0, 0.0], [0.0, -1e7, 1e6], [0.0, 0.0, -2e7]]))
    assert found == pytest.approx([1e-4], rel=1e-4)


def test_a_pair_is_told_once():
    assert growing_poles(model([[0.1, 2.0], [-2.0, 0.1]])) == pytest.approx([0.1 + 2j])


def test_without_states_nothing_grows():
    assert not growing_poles(model(np.zeros((0, 0)))).size
    assert not growing_poles(replace(model([[-1.0]]), states=("x",))).size
