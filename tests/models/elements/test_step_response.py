import numpy as np

from chladni.models.elements.catalogue import element
from chladni.models.elements.step_response import step_response
from chladni.models.elements.transfer_function import TransferFunction


def test_before_the_jump_nothing_happens_and_a_dead_time_comes_first() -> None:
    time_s = np.array([-1.0, 0.0, 0.29, 0.3, 1.3])
    found = step_response(TransferFunction(num=(2,), den=(1, 1), delay_s=0.3), time_s).values
    np.testing.assert_allclose(found, [0, 0, 0, 0, 2 * (1 - np.exp(-1.0))], rtol=1e-12)


def test_a_pd_gives_an_impulse_beside_its_gain() -> None:
    found = step_response(element("pd", gain=3.0, derivative_time=0.2).transfer, np.array([0.0, 1.0]))
    np.testing.assert_allclose(found.values, [3.0, 3.0])
    np.testing.assert_allclose(found.impulses, [0.6])


def test_a_pd2_gives_an_impulse_and_its_derivative() -> None:
    found = step_response(element("pd2", gain=1.0, time_constant=0.5, damping_ratio=0.3).transfer, np.array([1.0]))
    np.testing.assert_allclose(found.impulses, [0.3, 0.25])


def test_repeated_poles_need_no_case_of_their_own() -> None:
    time_s = np.linspace(0, 10, 50)
    found = step_response(TransferFunction(num=(1,), den=(1, 3, 3, 1)), time_s).values
    # Integral of t^2 exp(-t)/2.
    np.testing.assert_allclose(found, 1 - np.exp(-time_s) * (1 + time_s + time_s**2 / 2), atol=1e-13)
