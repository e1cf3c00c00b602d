"""Measured functions beside those synthesised from modes."""

from dataclasses import replace

import numpy as np

from chladni.signals.channel import Channel
from chladni.signals.mode_set import ModeSet
from chladni.viewers.overlays import FUNCTIONS, FUNCTIONS_IN_A_PLOT, left_out, overlay_pages
from tests.viewers import synthetic_modes as made

STUDY = made.arm_study()
MODES = made.modes_of(STUDY)


def test_each_function_stands_beside_its_measurement() -> None:
    pages = overlay_pages(MODES, STUDY.response)
    assert [page.name for page in pages] == ["1 Acceleration 1/2", "1 Acceleration 2/2"]
    assert [page.part for page in pages] == [" 1/2", " 2/2"]
    assert {(page.quantity, page.unit) for page in pages} == {("Accelerance", "(m/s^2)/N")}
    overlays = [overlay for page in pages for overlay in page.overlays]
    assert [overlay.response for overlay in overlays] == list(MODES.channels)
    assert MODES.fit is not None
    assert STUDY.response is not None
    for row, overlay in enumerate(overlays):
        np.testing.assert_array_equal(overlay.synthesised, MODES.fit.synthesised[row, 0])
        np.testing.assert_array_equal(overlay.measured, STUDY.response.values[row, 0])
        assert overlay.error == MODES.fit.function_error[row, 0]


def test_only_excited_lines_in_the_fitted_band_are_taken_for_measured() -> None:
    assert STUDY.response is not None
    assert MODES.fit is not None
    excited = STUDY.response.excited.copy()
    excited[10:20] = False
    wider = replace(
        MODES.fit, frequency_hz=MODES.fit.frequency_hz[100:300], synthesised=MODES.fit.synthesised[:, :, 100:300]
    )
    (page, *_) = overlay_pages(replace(MODES, fit=wider), replace(STUDY.response, excited=excited))
    hertz = page.overlays[0].measured_hz
    assert hertz[0] == wider.frequency_hz[0]
    assert hertz[-1] == wider.frequency_hz[-1]
    (page, *_) = overlay_pages(MODES, replace(STUDY.response, excited=excited))
    assert page.overlays[0].measured_hz.size == excited.size - 10


def test_modes_without_fit_or_measurement() -> None:
    assert overlay_pages(replace(MODES, fit=None), STUDY.response) == []
    for measured in (None, replace(STUDY.response, references=(Channel(name="/other", unit="N"),))):  # type: ignore[type-var]
        (page, *_) = overlay_pages(MODES, measured)
        assert page.overlays[0].measured_hz.size == 0
        assert page.overlays[0].synthesised.size > 0


def many() -> ModeSet:
    """Two references and 40 responses, the error rising from function to function."""
    assert MODES.fit is not None
    channels = tuple(Channel(name=f"/{row}.x", unit="m/s^2") for row in range(40))
    references = tuple(Channel(name=f"/f{column}.x", unit="N", role="reference") for column in range(2))
    fit = replace(
        MODES.fit,
        synthesised=np.ones((40, 2, MODES.fit.frequency_hz.size), dtype=complex),
        lower_residual=np.zeros((40, 2), dtype=complex),
        upper_residual=np.zeros((40, 2), dtype=complex),
        function_error=np.arange(80.0).reshape(40, 2),
    )
    return replace(
        MODES,
        channels=channels,
        references=references,
        shapes=np.ones((5, 40), dtype=complex),
        shape_std=np.zeros((5, 40), dtype=complex),
        participation=np.ones((5, 2), dtype=complex),
        fit=fit,
    )


def test_of_very_many_functions_those_that_fit_worst_are_drawn_and_the_rest_is_told() -> None:
    modes = many()
    assert modes.fit is not None
    pages = overlay_pages(modes, None)
    errors = sorted(overlay.error for page in pages for overlay in page.overlays)
    assert errors == list(range(80 - FUNCTIONS, 80))
    assert all(len(page.overlays) <= FUNCTIONS_IN_A_PLOT for page in pages)
    assert len({page.name for page in pages}) == len(pages)
    assert left_out(modes.fit) == " · the 24 of 80 functions with the greatest error"
    assert MODES.fit is not None
    assert left_out(MODES.fit) == ""


def test_an_error_that_is_not_known_counts_as_the_greatest() -> None:
    modes = many()
    assert modes.fit is not None
    error = modes.fit.function_error.copy()
    error[0, 0] = np.nan
    pages = overlay_pages(replace(modes, fit=replace(modes.fit, function_error=error)), None)
    assert "/0.x" in {overlay.response.name for page in pages for overlay in page.overlays}
