"""What a log tells only of two parameters together is told as their correlation."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.correlation import correlation_of
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.tuning.output_error import fit_output_error
from tests.gap.made_log import band_noise, chain, measured


def test_of_two_springs_side_by_side_only_the_sum_is_told() -> None:
    one = chain([2.0], [5e5], [40.0])
    spring = replace(one.structure.joints[0], stiffness=2.5e5, damping=20.0)
    twice = (spring, replace(spring, name="other"))
    model = replace(one, structure=replace(one.structure, joints=twice))
    log, floor = measured(model, band_noise(3000), noise=0.02)
    run = FreeRun(model, log)
    found = correlation_of(run.tunables, fit_output_error(run, floor))
    assert found is not None
    place = [found.names.index(f"{name}.stiffness") for name in ("j0", "other")]
    # Each tolerance alone is 1, their difference is as uncertain as before: the covariance is (1 -1; -1 1)/2.
    assert found.matrix[place[0], place[1]] == pytest.approx(-1.0, abs=0.02)
    np.testing.assert_array_equal(np.diag(found.matrix), 1.0)
    np.testing.assert_allclose(found.matrix, found.matrix.T, atol=1e-9)
    assert np.linalg.eigvalsh(found.matrix).min() > -1e-9


def test_nothing_tuned_has_none() -> None:
    model = chain([2.0], [5e5], [40.0])
    log, floor = measured(model, band_noise(1000))
    run = FreeRun(model, log)
    assert correlation_of(run.tunables, fit_output_error(run, floor, tune=False)) is None
