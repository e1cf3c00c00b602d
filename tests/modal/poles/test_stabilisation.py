import numpy as np
import pytest

from chladni.modal.experimental.cmif import complex_mode_indicator
from chladni.modal.poles.stabilisation import StabilityLimits, pole_status, stabilisation_diagram
from chladni.signals.errors import SetupError
from chladni.signals.stabilisation_diagram import POLE_STATUSES
from tests.modal import truth
from tests.modal.pole_tables import empty_table, table_of

ONE, OTHER = (1.0, 0.0), (0.0, 1.0)


def statuses(*rows, orders=(1, 2, 3), **limits):
    table = table_of([(1, 10.0, 0.01, ONE), *rows], orders)
    return [POLE_STATUSES[status] for status in pole_status(table, StabilityLimits(**limits))]


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ((2, 10.05, 0.0102, ONE), "vector"),
        ((2, 10.05, 0.0102, OTHER), "damping"),
        ((2, 10.05, 0.02, ONE), "frequency"),
        # Damping and vector agree, but it is another frequency.
        ((2, 10.2, 0.01, ONE), "new"),
        # Order 2 is empty: nothing below to agree with.
        ((3, 10.0, 0.01, ONE), "new"),
    ],
)
def test_agreement_with_the_order_below(row, expected):
    assert statuses(row) == ["new", expected]


def test_the_best_partner_counts():
    assert statuses((1, 10.01, 0.01, OTHER), (2, 10.0, 0.01, OTHER))[-1] == "vector"


def test_limits_are_parameters():
    row = (2, 10.05, 0.0102, (np.sqrt(0.97), np.sqrt(0.03)))
    assert statuses(row)[-1] == "damping"
    assert statuses(row, mac=0.95)[-1] == "vector"
    assert statuses(row, damping=0.01)[-1] == "frequency"
    assert statuses(row, frequency=0.001)[-1] == "new"


@pytest.mark.parametrize("wrong", [{"frequency": 0.0}, {"damping": 1.0}, {"mac": 1.5}])
def test_impossible_limits(wrong):
    with pytest.raises(SetupError, match="must be above 0 and below 1"):
        StabilityLimits(**wrong)


def test_diagram_holds_the_poles_over_the_indicator():
    table = table_of([(1, 10.0, 0.01, ONE), (2, 10.0, 0.01, ONE)], (1, 2))
    line, curve = np.array([1.0, 2.0]), np.array([[3.0, 4.0]])
    diagram = stabilisation_diagram(
        table,
        member=np.array([-1, 0]),
        indicator_hz=line,
        indicator=curve,
        indicator_name="CMIF",
        indicator_unit="(m/s^2)/N",
    )
    assert diagram.status.tolist() == [0, 3]
    assert diagram.mode.tolist() == [-1, 0]
    np.testing.assert_allclose(diagram.frequency_hz, 10.0)
    assert (diagram.indicator_name, diagram.indicator_unit) == ("CMIF", "(m/s^2)/N")


def test_without_poles():
    assert pole_status(empty_table()).size == 0


def test_indicator_is_the_singular_values():
    rng = np.random.default_rng(3)
    lines = np.linspace(1.0, 20.0, 40)
    for at in ((0,), (0, 1), tuple(range(6))):
        response = truth.noisy_response(truth.close_modes(), lines, at, noise=0.03, rng=rng)
        expected = np.linalg.svd(np.moveaxis(response.values, -1, 0), compute_uv=False).T
        # Squared on the way: small values keep half the digits of the greatest.
        np.testing.assert_allclose(complex_mode_indicator(response), expected, atol=2e-7 * expected.max())


def test_indicator_of_fewer_responses_than_references_and_of_missing_lines():
    response = truth.noisy_response(
        truth.close_modes(), np.linspace(1, 20, 9), (0, 1), noise=0.0, rng=np.random.default_rng(0)
    )
    values = response.values[:1].copy()
    values[..., 4] = np.nan
    fewer = type(response)(
        frequency_hz=response.frequency_hz,
        values=values,
        std=response.std[:1],
        coherence=response.coherence[:1],
        excited=response.excited,
        responses=response.responses[:1],
        references=response.references,
        provenance=response.provenance,
    )
    indicator = complex_mode_indicator(fewer)
    assert indicator.shape == (1, 9)
    assert np.flatnonzero(np.isnan(indicator[0])).tolist() == [4]
    finite = np.isfinite(indicator[0])
    expected = np.linalg.norm(values[0][:, finite], axis=0)
    np.testing.assert_allclose(indicator[0, finite], expected, rtol=1e-12)
