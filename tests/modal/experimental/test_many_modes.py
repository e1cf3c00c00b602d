"""Many modes: a closer look at short bands, and fits group by group."""

import numpy as np
import pytest

from chladni.modal.experimental.grouped_refinement import ALONE, grouped_refinement
from chladni.modal.experimental.judged_lines import judged_lines
from chladni.modal.experimental.pole_search import closer_search, default_order, first_search, unexplained_lines
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.fit.maximum_likelihood import refine
from chladni.modal.fit.synthesis import modal_fit
from tests.modal import truth

LINES_HZ = np.arange(1.0, 400.0, 0.1)


def many(count):
    """Modes all over the band, no two within ten half-widths, on six masses."""
    rng = np.random.default_rng(5)
    shapes = rng.standard_normal((count, 6))
    return truth.ModalTruth(
        frequency_hz=np.linspace(25.0, 390.0, count) + rng.uniform(-3, 3, count),
        damping_ratio=np.full(count, 0.004),
        shapes=shapes / np.linalg.norm(shapes, axis=1)[:, None],
    )


@pytest.fixture(scope="module")
def model():
    return many(30)


@pytest.fixture(scope="module")
def response(model):
    return truth.noisy_response(model, LINES_HZ, (0, 1), noise=0.02, rng=np.random.default_rng(6))


@pytest.fixture(scope="module")
def participation(model):
    return model.shapes[:, :2].astype(complex)


def test_all_of_many_modes_are_found_and_no_other(response, model):
    modes = PolyReferenceLeastSquares().identify(response)
    np.testing.assert_allclose(modes.frequency_hz, model.frequency_hz, rtol=3e-4)
    assert modes.fit.error < 0.06
    assert modes.fit.bands_hz.shape == (30, 2)


@pytest.mark.nightly
def test_groups_give_what_a_fit_of_all_gives(response, model, participation):
    assert model.poles.size > ALONE
    parts = grouped_refinement(response, model.poles, participation, max_iterations=15)
    whole = refine(response, least_squares_frequency_domain(response, model.poles, participation))
    np.testing.assert_array_equal(parts.kept, whole.kept)
    moved = (parts.model.frequency_hz - whole.model.frequency_hz) / whole.frequency_std_hz
    # Residuals in place of the far modes cost a fraction of a sigma.
    assert np.abs(moved).max() < 1.5
    np.testing.assert_allclose(np.median(parts.frequency_std_hz / whole.frequency_std_hz), 1.0, atol=0.3)
    rows = np.arange(30)
    assert np.all(parts.covariance[rows, 0, rows, 0] > 0)
    assert np.abs((parts.model.frequency_hz - model.frequency_hz) / parts.frequency_std_hz).max() < 6


def test_few_modes_are_fitted_together(response, model, participation):
    few = slice(0, 5)
    parts = grouped_refinement(response, model.poles[few], participation[few], max_iterations=3)
    start = least_squares_frequency_domain(response, model.poles[few], participation[few])
    whole = refine(response, start, max_iterations=3)
    np.testing.assert_array_equal(parts.model.poles, whole.model.poles)


def test_lines_of_a_missing_mode_are_unexplained(response, model, participation):
    lines = judged_lines(response, "accelerance", band_hz=None)
    s2 = (2j * np.pi * LINES_HZ) ** 2
    present = np.arange(30) != 12
    fewer = least_squares_frequency_domain(response, model.poles[present], participation[present])
    without = modal_fit(response, fewer).synthesised / s2
    found = unexplained_lines(lines, without)
    peak = np.argmin(np.abs(LINES_HZ - model.frequency_hz[12]))
    assert found[peak]
    exact = model.accelerance(LINES_HZ, (0, 1)) / s2
    assert not unexplained_lines(lines, exact).any()


def test_a_closer_look_finds_what_low_orders_miss(response, model):
    lines = judged_lines(response, "accelerance", band_hz=None)
    search = first_search(response, lines, max_order=3)
    closer = closer_search(search, response, lines, np.zeros_like(lines.values))
    assert len(closer.cores_hz) > 1

    def misses(table):
        nearest = np.min(np.abs(table.frequency_hz[:, None] - model.frequency_hz), axis=0, initial=np.inf)
        return np.count_nonzero(nearest > 1e-3 * model.frequency_hz)

    assert misses(closer.table) < misses(search.table)
    # Nothing is looked at in the same way twice.
    assert closer_search(closer, response, lines, np.zeros_like(lines.values)) is None
    exact = model.accelerance(LINES_HZ, (0, 1)) / (2j * np.pi * LINES_HZ) ** 2
    assert closer_search(search, response, lines, exact) is None


@pytest.mark.parametrize(
    ("lines", "references", "order"), [(10_000, 1, 60), (80, 1, 20), (10_000, 10, 24), (6, 1, 2), (10_000, 500, 2)]
)
def test_default_order(lines, references, order):
    assert default_order(lines, references) == order
