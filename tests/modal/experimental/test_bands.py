from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.experimental.bands import join_bands
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from chladni.signals.errors import EstimateError
from tests.modal import truth

CHAIN = truth.chain()


@pytest.fixture(scope="module")
def response():
    lines_hz = np.arange(0.02, 8.0, 0.02)
    return truth.noisy_response(CHAIN, lines_hz, (0,), noise=0.03, rng=np.random.default_rng(4))


@pytest.fixture(scope="module")
def bands(response):
    # The second and the third mode lie in two bands each.
    identify = PolyReferenceLeastSquares().identify
    return [identify(response, band_hz=band) for band in ((4.0, 7.9), (0.1, 3.5), (2.0, 5.2))]


def test_modes_of_overlapping_bands_are_counted_once(bands):
    assert sum(one.frequency_hz.size for one in bands) == 7
    joined = join_bands(bands)
    assert joined.frequency_hz.size == 5
    # Residuals stand for the modes of other bands, to more than the noise at the borders.
    np.testing.assert_allclose(joined.frequency_hz, CHAIN.frequency_hz, rtol=1e-3)
    assert all(truth.mac(one, other) > 0.998 for one, other in zip(joined.shapes, CHAIN.shapes, strict=True))
    assert any("2 modes were found by two bands" in note for note in joined.provenance.notes)


def test_uncertainty_is_that_of_the_band_that_knows_the_mode_better(bands):
    joined = join_bands(bands)
    for mode, frequency_hz in enumerate(joined.frequency_hz):
        offers = [
            one.frequency_std_hz[near]
            for one in bands
            for near in np.flatnonzero(np.abs(one.frequency_hz / frequency_hz - 1) < 0.01)
        ]
        assert joined.frequency_std_hz[mode] == min(offers)
        source = next(one for one in bands if joined.frequency_std_hz[mode] in one.frequency_std_hz)
        row = int(np.flatnonzero(source.frequency_std_hz == joined.frequency_std_hz[mode])[0])
        for name in ("frequency_hz", "damping_ratio", "damping_std", "shapes", "shape_std", "participation"):
            np.testing.assert_array_equal(getattr(joined, name)[mode], getattr(source, name)[row])
        assert joined.spread.frequency_hz[mode] == source.spread.frequency_hz[row]
        assert joined.scale.modal_mass[mode] == source.scale.modal_mass[row]


def test_poles_of_a_mode_left_out_point_to_the_one_that_stands_for_it(bands):
    diagram = join_bands(bands).stabilisation
    assert diagram.order.size == sum(one.stabilisation.order.size for one in bands)
    assert np.all(np.diff(diagram.order) >= 0)
    for mode, frequency_hz in enumerate(CHAIN.frequency_hz):
        members = diagram.frequency_hz[diagram.mode == mode]
        assert np.abs(members / frequency_hz - 1).max() < 0.02
    counts = [np.count_nonzero(one.stabilisation.mode >= 0) for one in bands]
    assert np.count_nonzero(diagram.mode >= 0) == sum(counts)
    assert np.all(np.diff(diagram.indicator_hz) > 0)


def test_synthesis_covers_all_bands(bands, response):
    fit = join_bands(bands).fit
    inside = (response.frequency_hz >= 0.1) & (response.frequency_hz <= 7.9)
    np.testing.assert_array_equal(fit.frequency_hz, response.frequency_hz[inside])
    measured = response.values[..., inside]
    wrong, power = np.abs(measured - fit.synthesised) ** 2, np.abs(measured) ** 2
    # Put together from the errors of bands that overlap, so not to the last digit.
    assert fit.error == pytest.approx(np.sqrt(wrong.sum() / power.sum()), rel=0.2)
    each = np.sqrt(wrong.sum(axis=-1) / power.sum(axis=-1))
    np.testing.assert_allclose(fit.function_error, each, rtol=0.3)
    np.testing.assert_array_equal(fit.lower_residual, bands[1].fit.lower_residual)
    np.testing.assert_array_equal(fit.upper_residual, bands[0].fit.upper_residual)
    assert fit.bands_hz.shape == (7, 2)


def test_close_modes_of_one_band_stay_two():
    model = truth.close_modes()
    rng = np.random.default_rng(1)
    close = truth.noisy_response(model, np.arange(9.0, 11.0, 0.01), (0, 1), noise=0.01, rng=rng)
    modes = PolyReferenceLeastSquares().identify(close)
    assert join_bands([modes, modes]).frequency_hz.size == 2


def test_near_modes_of_two_bands_with_different_shapes_stay_two(bands):
    one = bands[1]
    other = replace(one, shapes=one.shapes[::-1])
    assert join_bands([one, other]).frequency_hz.size == 4


def test_one_band_and_empty_bands(bands, response):
    assert join_bands(bands[:1]) is bands[0]
    nothing = PolyReferenceLeastSquares().identify(response, band_hz=(3.3, 4.1))
    assert nothing.frequency_hz.size == 0
    joined = join_bands([bands[1], nothing])
    np.testing.assert_array_equal(joined.frequency_hz, bands[1].frequency_hz)
    assert joined.scale is not None
    np.testing.assert_array_equal(joined.fit.synthesised, bands[1].fit.synthesised)
    assert join_bands([nothing, nothing]).fit is None


def test_what_not_all_bands_have_is_left_out(bands):
    poorer = replace(bands[0], spread=None, stabilisation=None, fit=None, participation=None, scale=None)
    joined = join_bands([poorer, bands[1]])
    assert (joined.spread, joined.stabilisation, joined.fit) == (None, None, None)
    assert (joined.participation, joined.scale) == (None, None)
    assert joined.frequency_hz.size == 5
    elsewhere = replace(bands[0], scale=replace(bands[0].scale, response="/other"))
    assert join_bands([elsewhere, bands[1]]).scale is None


def test_bands_of_different_tests_are_not_joined(bands):
    other = replace(bands[0], channels=tuple(channel.with_name("/x" + channel.name) for channel in bands[0].channels))
    with pytest.raises(EstimateError, match="bands have different channels"):
        join_bands([bands[0], other])
    alone = replace(bands[0], references=(), participation=None, fit=None)
    with pytest.raises(EstimateError, match=r"different references: /force0.z against none"):
        join_bands([bands[0], alone])
    with pytest.raises(EstimateError, match="no sets of modes"):
        join_bands([])
