"""Message paths, against what Foxglove's syntax says of each."""

from contextlib import suppress

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from chladni.io.message_path import (
    FieldStep,
    FilterStep,
    IndexStep,
    KeyStep,
    element_text,
    parse_message_path,
    quoted,
    topic_text,
)
from chladni.signals.errors import LogError
from chladni.signals.visible import as_meant, visible
from chladni.signals.wording import near_matches

TOPICS = ("/imu", "/imu/wrist", "/a.b", "/a", "/log", "/top floor")


def steps(text: str) -> tuple[object, ...]:
    return parse_message_path(text, TOPICS).steps


def test_longest_topic_wins() -> None:
    assert parse_message_path("/a.b.c", TOPICS).topic == "/a.b"
    assert parse_message_path("/a.c", TOPICS).topic == "/a"
    assert parse_message_path("/imu/wrist.x", TOPICS).topic == "/imu/wrist"


def test_a_topic_ends_where_a_field_begins() -> None:
    # "/imu" is a prefix of the text, but "/imux" is another topic.
    with pytest.raises(LogError, match=r"'/imux\.y': no topic .* did you mean /imu"):
        parse_message_path("/imux.y", TOPICS)


def test_fields_and_elements() -> None:
    assert steps("/imu.linear_acceleration.x") == (FieldStep(name="linear_acceleration"), FieldStep(name="x"))
    assert steps("/imu.position[12]") == (FieldStep(name="position"), IndexStep(index=12))
    assert steps("/imu.position[elbow]") == (FieldStep(name="position"), KeyStep(name="elbow"))
    assert steps('/imu.position["left elbow"]') == (FieldStep(name="position"), KeyStep(name="left elbow"))
    assert steps("/imu[3]") == (IndexStep(index=3),)
    assert steps("/imu[٣]") == (KeyStep(name="٣"),)
    assert steps("/imu") == ()


@pytest.mark.parametrize(
    ("text", "field", "operator", "value"),
    [
        ('{name=="a"}', "name", "==", "a"),
        ("{name=='a b'}", "name", "==", "a b"),
        ("{field.sub==3}", "field.sub", "==", 3.0),
        ("{x != -2.5}", "x", "!=", -2.5),
        ("{x<=1e3}", "x", "<=", 1000.0),
        ("{x>=1}", "x", ">=", 1.0),
        ("{x<1}", "x", "<", 1.0),
        ("{x>1}", "x", ">", 1.0),
        ("{on==true}", "on", "==", True),
        ("{on==false}", "on", "==", False),
        ('{name=="a \\"b\\""}', "name", "==", 'a "b"'),
    ],
)
def test_filters(text: str, field: str, operator: str, value: object) -> None:
    (found, last) = steps(f"/log{text}.value")
    assert found == FilterStep(field=field, operator=operator, value=value)  # type: ignore[arg-type]
    assert type(found.value) is type(value)
    assert last == FieldStep(name="value")


def test_open_slice_before_a_filter() -> None:
    assert steps('/log.parts[:]{id=="a"}.x')[1] == IndexStep(index=None)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("/imu..x", r"'\.\.x' isn't understood"),
        ("/imu.x[1:3]", r"'\[1:3\]' isn't understood"),
        ("/imu.x[-1]", r"'\[-1\]' isn't understood"),
        ("/imu.x{y}", r"'\{y\}' isn't understood"),
        ("/imu.x[" + "9" * 5000 + "]", "no array has an element 99999999999999999999"),
        ("/imu.x[9223372036854775808]", "no array has an element 9223372036854775808"),
        ("/imu{a==1_0}", "'1_0' in the filter is neither a number"),
        ("/imu{a==٣}", "in the filter is neither a number"),
        ("/imu{a==nan}", "'nan' in the filter is neither a number"),
        ("/imu{a==b}", "'b' in the filter is neither a number nor true or false"),
        ("/imu{a==$v}", r"'\$v' in the filter"),
        ("/imu.x.@derivative", "functions such as .@derivative aren't supported"),
    ],
)
def test_what_is_refused_is_named(text: str, told: str) -> None:
    with pytest.raises(LogError, match=told):
        parse_message_path(text, TOPICS)


def test_quoted_topic() -> None:
    found = parse_message_path('"/top floor".x', TOPICS)
    assert (found.topic, found.steps, found.rest) == ("/top floor", (FieldStep(name="x"),), "x")


def test_rest_is_what_follows_the_topic() -> None:
    assert parse_message_path("/a.b.c[2]", TOPICS).rest == "c[2]"


@given(st.text(min_size=1, max_size=20) | st.just("@type"))
def test_a_quoted_name_parses_to_itself(name: str) -> None:
    assert steps(f"/imu.{quoted(name)}") == (FieldStep(name=name),)


@given(st.text(max_size=40))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    # Anything but a LogError would end the test.
    with suppress(LogError):
        assert parse_message_path(f"/imu{text}", TOPICS).text == as_meant(f"/imu{text}")


def test_near_matches_of_nothing_and_of_far() -> None:
    assert near_matches("a", []) == "there are none"
    assert near_matches("qqq", [f"/topic{i}" for i in range(10)]).endswith("/topic7 and 2 more")


@given(st.text(min_size=1, max_size=20) | st.sampled_from(["7", " a", "a ", "-1", ":", 'a"b', "²"]))
def test_the_name_of_an_element_parses_to_itself(name: str) -> None:
    assert steps(f"/imu.x{element_text(name)}") == (FieldStep(name="x"), KeyStep(name=name))


@given(topic=st.text(min_size=1), key=st.text(), joint=st.text())
@example(topic="/a\\x1b", key="\x1b", joint="\\x1b")
@example(topic="/a\x1b[2J", key="\n", joint="3")
@example(topic="/a", key="a\\", joint="[x]")
def test_what_is_shown_of_a_path_is_the_path(topic: str, key: str, joint: str) -> None:
    path = f"{topic_text(topic)}.{quoted(key)}{element_text(joint)}"
    for written in (path, visible(path)):
        parsed = parse_message_path(written, [topic])
        assert (parsed.text, parsed.topic) == (path, topic)
        assert parsed.steps == (FieldStep(name=key), KeyStep(name=joint))
        assert parsed.rest == f"{quoted(key)}{element_text(joint)}"


def test_topics_that_look_alike_are_told_apart() -> None:
    topics = ["/a\x1b", "/a\\x1b"]
    for topic in topics:
        assert parse_message_path(visible(f"{topic_text(topic)}.x"), topics).topic == topic
    assert len({visible(topic_text(topic)) for topic in topics}) == 2


def test_advice_shows_what_it_names() -> None:
    with pytest.raises(LogError, match=r"did you mean /imu\\x1b\[2J\?$"):
        parse_message_path("/imu.x", ["/imu\x1b[2J"])
