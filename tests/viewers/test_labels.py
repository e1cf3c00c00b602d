"""Words on plots."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.viewers.labels import (
    LONGEST_NAME,
    amplitude_density_unit,
    printed_unit,
    quantity,
    reduction,
    response_quantity,
    short_names,
    thinned,
)


@pytest.mark.parametrize(
    ("names", "labels"),
    [
        (["/imu/wrist.linear_acceleration.x", "/hammer.wrench.force.z"], ["wrist.x", "hammer.z"]),
        # The same last field twice: all fields tell them apart.
        (
            ["/imu.linear_acceleration.x", "/imu.angular_velocity.x"],
            ["imu.linear_acceleration.x", "imu.angular_velocity.x"],
        ),
        # The same topic's end twice: only the whole name does.
        (["/left/imu.a.x", "/right/imu.a.x"], ["/left/imu.a.x", "/right/imu.a.x"]),
        (["/daq.ch1", "/daq.ch2"], ["daq.ch1", "daq.ch2"]),
        (['/log{name=="a/b.c"}.value'], ['log{name=="a/b.c"}.value']),
        (["/joints.position[elbow.left]"], ["joints.position[elbow.left]"]),
        (["x"], ["x"]),
        ([""], ["(no name)"]),
        (["/a\n.x"], ["a\\n.x"]),
    ],
)
def test_labels_are_as_short_as_they_can_be(names: list[str], labels: list[str]) -> None:
    assert list(short_names(names).values()) == labels


@given(names=st.lists(st.text(alphabet=st.sampled_from("ab/.[]{}\"'_\n$"), max_size=12), max_size=8))
def test_labels_are_all_different_and_of_bounded_length(names: list[str]) -> None:
    labels = short_names(names)
    assert set(labels) == set(names)
    assert len(set(labels.values())) == len(labels)
    assert all(label.isprintable() for label in labels.values())


def test_a_name_of_a_thousand_characters_becomes_a_label() -> None:
    names = [f"/{'a' * 1000}{end}{'b' * 1000}" for end in "xyz"]
    labels = short_names(names)
    assert len(set(labels.values())) == 3
    assert all(len(label) <= LONGEST_NAME + 3 for label in labels.values())


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
