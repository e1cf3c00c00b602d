import numpy as np
import pytest

from chladni.modal.operational.response_shapes import (
    ResponseShape,
    largest_one,
    modal_filters,
    modal_spectrum,
    shape_at,
)
from chladni.modal.operational.spectral_decomposition import decompose
from chladni.spectral.cross_spectra import cross_spectra
from tests.modal.made_spectra import expected_spectra
from tests.modal.truth import ambient_record, chain

ONE = np.array([1.0, 0.8j, -0.3])
OTHER = np.array([0.5, 1.0, 0.2j])


def test_a_complex_shape_comes_back_without_bias():
    found = decompose(expected_spectra([(10.0, 0.01, ONE)], spacing_hz=0.05, lines=400))
    unit, std = largest_one(shape_at(found, 200, 0.1), found.scale)
    # The same floor on all channels doesn't turn the first vector.
    np.testing.assert_allclose(unit, ONE, atol=1e-12)
    assert std[0] == 0
    assert np.all(std[1:].real == std[1:].imag)


def test_filters_take_other_modes_out_even_if_shapes_are_not_orthogonal():
    first, second = modal_filters([ONE, OTHER])
    assert np.vdot(first, ONE) == pytest.approx(1.0)
    assert np.vdot(first, OTHER) == pytest.approx(0.0, abs=1e-12)
    assert np.vdot(second, ONE) == pytest.approx(0.0, abs=1e-12)
    found = decompose(expected_spectra([(10.0, 0.01, ONE), (13.0, 0.01, OTHER)], spacing_hz=0.05, lines=400))
    alone = decompose(expected_spectra([(10.0, 0.01, ONE)], spacing_hz=0.05, lines=400))
    np.testing.assert_allclose(modal_spectrum(found, first), modal_spectrum(alone, first), atol=1e-9)


def test_shapes_that_sensors_cannot_tell_apart_weight_by_themselves():
    assert modal_filters([]) == []
    for shapes in ([ONE, ONE + 1e-3 * OTHER], [ONE, OTHER, np.ones(3), np.array([1.0, -1.0, 0.0])]):
        for filtered, shape in zip(modal_filters(shapes), shapes, strict=True):
            np.testing.assert_array_equal(filtered, shape)


def test_the_error_of_a_shape_turns_and_scales_with_its_largest_component():
    shape = ResponseShape(vector=np.array([0.6j, 0.8]), covariance=np.diag([4e-4, 0.0]).astype(complex))
    unit, std = largest_one(shape, np.array([1.0, 2.0]))
    # v_0/(2 v_1) with a std of 0.02/sqrt(2) in either part of v_0.
    np.testing.assert_allclose(unit, [0.375j, 1.0])
    np.testing.assert_allclose(std, [0.02 / np.sqrt(2) / 1.6 * (1 + 1j), 0.0])


def test_error_bars_of_shapes_cover_the_truth():
    rng, truth = np.random.default_rng(3), chain()
    inside = []
    for _ in range(12):
        found = decompose(cross_spectra(ambient_record(truth, cycles=600, rng=rng, noise=0.1), resolution_hz=0.04))
        for mode in range(5):
            line = round(truth.frequency_hz[mode] / 0.04)
            unit, std = largest_one(shape_at(found, line, 0.01 * truth.frequency_hz[mode]), found.scale)
            error = unit - truth.unit_shapes[mode]
            free = std.real > 0
            inside += list(np.abs(error.real[free]) <= 1.96 * std.real[free])
            inside += list(np.abs(error.imag[free]) <= 1.96 * std.imag[free])
    # 480 numbers, of which those of one shape hang together; 0.95 within four sigma of 120 independent ones.
    assert 0.87 < np.mean(inside) < 0.995
