"""Words on plots."""

from chladni.viewers.labels import (
    amplitude_density_unit,
    printed_unit,
    quantity,
    reduction,
    response_quantity,
    thinned,
)


def test_units_and_quantities_are_the_fields_own_words() -> None:
    assert printed_unit("(m/s^2)^2/Hz") == "(m/s²)²/Hz"
    assert amplitude_density_unit("N") == "N/√Hz"
    assert amplitude_density_unit("m/s^2") == "(m/s²)/√Hz"
    assert quantity("rad/s") == "Angular velocity"
    assert quantity("furlong") == "Signal"
    assert response_quantity("m/s", "N") == "Mobility"
    assert response_quantity("m/s^2", "m/s^2") == "Transmissibility"
    assert response_quantity("V", "N") == "Frequency response"


def test_a_thinned_plot_says_so_and_a_full_one_does_not() -> None:
    assert thinned(1) == ""
    assert "every 8 samples" in thinned(8)
    assert reduction(1, 1) == ""
    assert reduction(2, 3) == " · greatest of every 2 slices x 3 lines"
