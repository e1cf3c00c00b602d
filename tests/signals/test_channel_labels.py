"""Labels of channels: short, all different, and taken wherever the name is."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.log import open_log
from chladni.signals.channel import Channel, find_channel, labelled, labels_of
from chladni.signals.channel_labels import LONGEST_NAME, short_names
from chladni.signals.channel_names import places_of
from chladni.signals.errors import EstimateError

LOGS = ["palisaden.mcap", "real_ros2_bag.mcap", "json_plc.mcap", "f16_level1.mcap", "emps.mcap", "hammer.mcap",
        "BK_4_channels.uff", "mr_0A.mcap"]  # fmt: skip


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


@given(names=st.lists(st.text(alphabet=st.sampled_from("ab/._"), min_size=1, max_size=9), min_size=1, max_size=8))
def test_a_label_names_its_channel_among_those_it_was_made_for(names: list[str]) -> None:
    known = list(dict.fromkeys(names))
    for name, label in short_names(known).items():
        assert places_of(label, known) == (known.index(name),)


@given(
    names=st.lists(st.text(alphabet=st.sampled_from("ab/._"), min_size=1, max_size=9), min_size=1, max_size=8),
    shown=st.integers(1, 8),
)
def test_a_label_of_a_log_s_channel_names_it_among_all_of_them(names: list[str], shown: int) -> None:
    channels = labelled(Channel(name=name) for name in dict.fromkeys(names))
    for name, label in labels_of(channels[:shown]).items():
        assert channels[find_channel(channels, label)].name == name


def test_a_label_of_few_channels_that_fits_several_of_all_is_told_with_them() -> None:
    names = ["/imu/base.accel.x", "/imu/base.gyro.x", "/imu/arm.accel.x"]
    with pytest.raises(EstimateError, match=r"is short for 2 channels: /imu/base\.accel\.x, /imu/base\.gyro\.x; "):
        places_of("base.x", names)
    assert places_of("arm.x", names) == (2,)
    # How one name ends is no label of another.
    assert short_names(["/t/b.q.x", "/c/z.b.x"]) == {"/t/b.q.x": "b.q.x", "/c/z.b.x": "z.x"}


def test_a_channel_keeps_its_label_under_the_name_of_its_log_alone() -> None:
    (channel,) = labelled([Channel(name="/imu/base.accel.x")])
    assert channel.with_name("a.mcap: /imu/base.accel.x").label == channel.label == "base.x"
    assert channel.with_name("tip").label == ""
    assert channel == Channel(name="/imu/base.accel.x")


@pytest.mark.parametrize("file", LOGS)
def test_every_label_that_is_shown_of_a_log_is_taken_by_it(shared_data: Path, file: str) -> None:
    log = open_log(shared_data / file)
    assert log.channels
    # Pictures show all, those of one unit, or one alone.
    units = {channel.unit for channel in log.channels}
    drawn = [log.channels, *([one for one in log.channels if one.unit == unit] for unit in units)]
    for shown in map(labels_of, drawn):
        assert tuple(log.names(list(shown.values()))) == tuple(shown)
    alone = {name: label for channel in log.channels for name, label in labels_of([channel]).items()}
    assert tuple(log.names(list(alone.values()))) == tuple(alone)
