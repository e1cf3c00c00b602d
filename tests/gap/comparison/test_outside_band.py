from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.gap.comparison.outside_band import products_outside
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.records.measurement import Measurement
from tests.gap.comparison import made_measurements as made

PERIOD, PERIODS = 4096, 6
LAWS = {
    "even": lambda d: d**2,
    "odd": lambda d: d**3,
    "clearance": lambda d: np.sign(d) * np.maximum(np.abs(d) - 0.7, 0.0),
    "stop": lambda d: np.maximum(d - 0.5, 0.0),
    "linear": lambda d: 0.0 * d,
}


def run(law: str, seed: int = 1, *, highest: int = 400) -> Measurement:
    """Three displacements; a force that follows the difference of the last two acts on all of them."""
    rng = np.random.default_rng(seed)
    u = np.tile(made.multisine(rng, PERIOD, np.arange(40, highest)), PERIODS + 1)
    # Motions that differ in phase: from the second on they come later, and not alike.
    filters = [([1.0], [1.0, -0.3]), ([0.0] * 6 + [1.0], [1.0, -1.7, 0.8]), ([0.0] * 11 + [2.0], [1.0, -1.5, 0.8])]
    linear = np.array([lfilter(b, a, u) for b, a in filters])
    d = linear[2] - linear[1]
    force = LAWS[law](d / d.std())
    answer = np.array([lfilter(b, a, force) for b, a in (([0.1], [1.0, -0.5]), ([0.2, 0.1], [1.0]), ([-0.1], [1.0]))])
    y = (linear + answer)[:, PERIOD:]
    noisy = y + 1e-3 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    return with_period(replace(made.measurement(u[PERIOD:], noisy), output_units=("m", "m", "m")))


@pytest.mark.parametrize(("law", "even", "odd"), [("even", True, False), ("odd", False, True),
                                                  ("clearance", False, True), ("stop", True, True)])  # fmt: skip
def test_parity_and_place_of_a_law_are_found(law: str, even: bool, odd: bool) -> None:
    found = products_outside(run(law))
    assert found is not None
    assert found.motion == ("acc2", "acc3")
    # Beyond the other kind, what isn't there explains nothing but by chance (0.01 for blocks of 60 lines).
    assert (found.even > 0.03) == even
    assert (found.odd > 0.03) == odd
    assert found.both > 0.9
    told = found.sentence()
    assert "between acc2 and acc3" in told
    assert ("(odd and even told" in told) == (even and odd)


def test_a_linear_machine_has_nothing_there() -> None:
    assert products_outside(run("linear")) is None


def test_no_answer_without_room_above_the_band_or_without_periods() -> None:
    assert products_outside(run("odd", highest=1950)) is None
    noise = np.random.default_rng(2).standard_normal(4000)
    assert products_outside(with_period(made.measurement(noise, noise**3))) is None


def test_outputs_of_different_units_are_not_subtracted() -> None:
    mixed = replace(run("odd"), output_units=("m", "m", "m/s"))
    found = products_outside(mixed)
    assert found is not None
    assert "acc3" not in found.motion or len(found.motion) == 1


@pytest.mark.parametrize("level", [5, 7])
def test_measured_aircraft_is_odd_and_even_between_wing_and_payload(shared_data: Path, level: int) -> None:
    found = products_outside(made.aircraft(shared_data, level))
    assert found is not None
    assert found.motion == ("wing_rail", "payload_rail")
    assert found.odd > found.even > 0.03
