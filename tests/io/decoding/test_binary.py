"""CDR and ROS 1 messages to columns, against rosbags and mcap's ROS 2 decoder."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.io.decoding import make_decoder
from tests.io.decoding.definitions import Oracle, leaf_of, messages
from tests.io.decoding.encoded import batch_of, decode_all, values_of


def flattened(value: Any) -> Any:
    """Lists of strings are tuples in a column; rosbags gives lists."""
    if isinstance(value, tuple):
        return list(value)
    if isinstance(value, list):
        return [one for element in value for one in (element if isinstance(element, tuple) else (element,))]
    return value


def assert_agrees(
    oracle: Oracle, *, seed: int, count: int, gaps: tuple[int, ...], little_endian: bool = True
) -> None:
    rng = np.random.default_rng(seed)
    values = [oracle.value(rng, oracle.root) for _ in range(count)]
    encoded = batch_of([oracle.encode(value, little_endian=little_endian) for value in values], gaps=gaps)
    decoder = make_decoder(
        message_encoding="cdr" if oracle.ros == 2 else "ros1",
        schema_name=f"demo/msg/{oracle.root.name}",
        schema_encoding="ros2msg" if oracle.ros == 2 else "ros1msg",
        schema_data=oracle.schema_text(),
    )
    whole = decode_all(decoder, encoded)
    assert not whole.bad.any(), whole.reasons
    for info in decoder.fields:
        expected = [leaf_of(value, info.path) for value in values]
        assert [flattened(value) for value in values_of(whole, info.path)] == expected
        alone = decoder.columns(encoded, [info.path])
        assert values_of(alone, info.path) == values_of(whole, info.path)


@given(
    root=messages(ros=2),
    seed=st.integers(0, 2**32),
    count=st.integers(1, 5),
    gaps=st.sampled_from([(5,), (5, 5, 9), (0,)]),
    little_endian=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_any_ros2_definition_reads_back_what_rosbags_wrote(
    root: Any, seed: int, count: int, gaps: tuple[int, ...], little_endian: bool
) -> None:
    assert_agrees(Oracle(root, ros=2), seed=seed, count=count, gaps=gaps, little_endian=little_endian)


@given(root=messages(ros=1), seed=st.integers(0, 2**32), count=st.integers(1, 5))
@settings(max_examples=40, deadline=None)
def test_any_ros1_definition_reads_back_what_rosbags_wrote(root: Any, seed: int, count: int) -> None:
    assert_agrees(Oracle(root, ros=1), seed=seed, count=count, gaps=(5, 5, 9))
