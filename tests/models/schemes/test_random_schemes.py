import numpy as np
from hypothesis import assume, given

from chladni.models.schemes.scheme_model import SchemeModel
from chladni.signals.errors import ModelError
from tests.models.schemes.random_schemes import KINDS, brute_force, schemes

FREQUENCY_HZ = np.geomspace(0.02, 5.0, 12)
PROPER = tuple(kind for kind in KINDS if kind not in ("d", "pd", "pd2", "pid", "dead-time"))


def behind_blocks(scheme: SchemeModel, response: np.ndarray) -> np.ndarray:
    """Rows of what leaves the blocks, in their order."""
    names = [point.terminal.name for point in scheme.points]
    return response[[names.index(block.name) for block in scheme.blocks]]


def assert_equal(found: np.ndarray, expected: np.ndarray, condition: np.ndarray) -> None:
    # Each line by its own largest signal: rounding grows with the condition of the loops, whoever computes.
    size = np.abs(expected).max(axis=(0, 1))
    worst = np.abs(found - expected).max(axis=(0, 1))
    assert np.all(worst <= size * np.minimum(1e-13 * condition + 1e-11, 1e-6) + 1e-300)


@given(schemes())
def test_every_point_is_the_brute_force_interconnection(scheme: SchemeModel) -> None:
    expected, condition = brute_force(scheme, FREQUENCY_HZ)
    assume(condition.max() < 1e6)
    assert_equal(behind_blocks(scheme, scheme.frequency_response(FREQUENCY_HZ)), expected, condition)


@given(schemes())
def test_the_compiled_equations_have_the_same_response(scheme: SchemeModel) -> None:
    try:
        compiled = scheme.compile()
    except ModelError:
        assume(False)
    condition = brute_force(scheme, FREQUENCY_HZ)[1]
    # Equations in time see gains at infinite frequency too; a cancellation there costs digits at every line.
    sizes = [np.abs(part).max(initial=1.0) for part in (compiled.a, compiled.b, compiled.c, compiled.d)]
    assume(condition.max() < 1e6 and max(sizes) < 1e5)
    found, expected = compiled.frequency_response(FREQUENCY_HZ), scheme.frequency_response(FREQUENCY_HZ)
    size = np.abs(expected).max(axis=(0, 1))
    assert np.all(np.abs(found - expected).max(axis=(0, 1)) <= 1e-8 * size + 1e-300)


@given(schemes(kinds=PROPER))
def test_a_proper_scheme_has_a_state_for_each_pole_and_no_lags(scheme: SchemeModel) -> None:
    try:
        compiled = scheme.compile()
    except ModelError:
        assume(False)
    assert not compiled.derivatives
    assert len(compiled.states) == sum(block.content.transfer.order for block in scheme.blocks)
    poles = np.linalg.eigvals(compiled.a) if compiled.states else np.empty(0)
    assume(poles.size == 0 or np.abs(poles).max() < 1e4)
    # det(I - H K) = prod(s - closed)/prod(s - open) * det(I - D K): the closed loops' poles, with no state space.
    s, step = 0.37 + 0.91j, 2.3 - 0.4j
    ratio = _return_difference(scheme, s) / _return_difference(scheme, step)
    open_poles = np.concatenate([block.content.transfer.poles() for block in scheme.blocks])
    expected = np.prod((s - poles) / (step - poles)) / np.prod((s - open_poles) / (step - open_poles))
    np.testing.assert_allclose(ratio, expected, rtol=1e-6)


def _return_difference(scheme: SchemeModel, s: complex) -> complex:
    names = [block.name for block in scheme.blocks]
    matrix = np.eye(len(names), dtype=complex)
    for row, block in enumerate(scheme.blocks):
        transfer = block.content.transfer
        for text in block.inputs:
            if text[1:] in names:
                sign = 1.0 if text[0] == "+" else -1.0
                matrix[row, names.index(text[1:])] -= sign * np.polyval(transfer.num, s) / np.polyval(transfer.den, s)
    return complex(np.linalg.det(matrix))
