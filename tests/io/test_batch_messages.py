"""Batch messages: layouts that are recognised, and samples laid out whatever the messages hold."""

import numpy as np
import pytest

from chladni.io.batch_messages import BatchLayout, column_names, column_units, expand, recognised_layout
from chladni.io.decoding import Column, Decoded, FieldInfo, Strings
from chladni.io.decoding.schema import FieldKind
from chladni.signals.errors import LogError


def field(path: str, kind: FieldKind = "number", *, array: bool = False) -> FieldInfo:
    dtype = None if kind == "string" else np.dtype(np.float64)
    return FieldInfo(path=path, kind=kind, dtype=dtype, dims=("dynamic",) if array else ())


def ragged(parts: list[list[float]]) -> Column:
    counts = np.array([len(part) for part in parts])
    return Column(values=np.array([value for part in parts for value in part]), counts=counts)


def decoded(columns: dict[str, Column], *, messages: int, bad: tuple[int, ...] = ()) -> Decoded:
    mask = np.zeros(messages, np.bool_)
    mask[list(bad)] = True
    return Decoded(columns=columns, bad=mask)


BLOCK = [field("sample_rate"), field("channel_names", "string", array=True), field("samples", array=True)]


def test_blocks_are_recognised_by_their_fields() -> None:
    layout = recognised_layout("daq_msgs/msg/SampleBlock", BLOCK)
    assert layout is not None
    assert (layout.period, layout.inverse, layout.names, layout.order) == (
        "sample_rate",
        True,
        "channel_names",
        "channel",
    )
    with_units = recognised_layout("a/B", [*BLOCK, field("units", "string", array=True)])
    assert with_units is not None
    assert with_units.units == "units"
    by_duration = recognised_layout("a/B", [field("dt", "duration"), *BLOCK[1:]])
    assert by_duration is not None
    assert (by_duration.period_unit, by_duration.inverse) == (1e-9, False)


@pytest.mark.parametrize(
    "fields",
    [
        BLOCK[:2],
        BLOCK[1:],
        [BLOCK[0], BLOCK[2]],
        [BLOCK[0], field("channel_names", "string"), BLOCK[2]],
        [BLOCK[0], BLOCK[1], field("samples")],
        [field("sample_rate", "string"), *BLOCK[1:]],
    ],
)
def test_what_lacks_a_part_is_no_block(fields: list[FieldInfo]) -> None:
    assert recognised_layout("a/B", fields) is None


def test_fifo_needs_its_fields() -> None:
    assert recognised_layout("px4_msgs/msg/SensorGyroFifo", [field("x", array=True)]) is None


@pytest.mark.parametrize("order", ["channel", "sample"])
def test_blocks_of_different_length(order: str) -> None:
    blocks = [np.arange(6.0).reshape(2, 3), np.arange(10.0, 14.0).reshape(2, 2)]
    parts = [(block if order == "channel" else block.T).reshape(-1).tolist() for block in blocks]
    layout = BatchLayout(samples=("s",), period=0.1, names=("a", "b"), order=order)  # type: ignore[arg-type]
    found = expand(layout, decoded({"s": ragged(parts)}, messages=2), ("a", "b"), [0, 1])
    np.testing.assert_array_equal(found.values, np.concatenate(blocks, axis=1))
    np.testing.assert_array_equal(found.counts, [3, 2])
    only = expand(layout, decoded({"s": ragged(parts)}, messages=2), ("a", "b"), [1])
    np.testing.assert_array_equal(only.values, found.values[1:])
    nothing = expand(layout, decoded({"s": ragged(parts)}, messages=2), ("a", "b"), [])
    assert nothing.values.shape == (0, 5)


def test_a_bad_message_in_the_middle_moves_no_other() -> None:
    layout = BatchLayout(samples=("x", "y"), period=0.1)
    columns = {"x": ragged([[1, 2], [3, 4, 5], [6, 7], [8]]), "y": ragged([[-1, -2], [-3], [-6, -7], [-8]])}
    found = expand(layout, decoded(columns, messages=4, bad=(3,)), ("x", "y"), [0, 1])
    np.testing.assert_array_equal(found.values, [[1, 2, 6, 7], [-1, -2, -6, -7]])
    np.testing.assert_array_equal(found.bad, [False, True, False, True])
    np.testing.assert_array_equal(found.counts, [2, 0, 2, 0])


def test_counts_cut_longer_arrays_and_refuse_shorter() -> None:
    layout = BatchLayout(samples=("x",), period=0.1, count="n")
    columns = {
        "x": Column(values=np.arange(12, dtype=np.int16).reshape(3, 4)),
        "n": Column(values=np.array([2, 5, 4], np.uint8)),
    }
    found = expand(layout, decoded(columns, messages=3), ("x",), [0])
    np.testing.assert_array_equal(found.values, [[0, 1, 8, 9, 10, 11]])
    np.testing.assert_array_equal(found.bad, [False, True, False])


def test_scales_and_periods_of_each_message() -> None:
    layout = BatchLayout(samples=("x",), period="dt", period_unit=1e-6, scale="k")
    columns = {
        "x": Column(values=np.ones((3, 2), np.float32)),
        "dt": Column(values=np.array([125.0, 0.0, np.nan])),
        "k": Column(values=np.array([2.0, 3.0, 4.0])),
    }
    found = expand(layout, decoded(columns, messages=3), ("x",), [0])
    np.testing.assert_array_equal(found.values, [[2.0, 2.0]])
    np.testing.assert_array_equal(found.bad, [False, True, True])
    assert found.periods_s[0] == 125e-6
    halved = expand(
        BatchLayout(samples=("x",), period=10.0, inverse=True, scale=0.5), decoded(columns, messages=3), ("x",), [0]
    )
    assert halved.values.dtype == np.float32
    assert (halved.values[0, 0], halved.periods_s[0]) == (0.5, 0.1)


def test_other_names_make_a_message_bad() -> None:
    layout = BatchLayout(samples=("s",), period=0.1, names="names")
    names = Strings(codes=np.array([0, 1, 0], np.int32), table=(("a", "b"), ("b", "a")))
    columns = {"s": Column(values=np.arange(12.0).reshape(3, 4)), "names": Column(values=names)}
    found = expand(layout, decoded(columns, messages=3), ("a", "b"), [0])
    np.testing.assert_array_equal(found.values, [[0, 1, 8, 9]])
    np.testing.assert_array_equal(found.bad, [False, True, False])


def test_a_column_of_text_is_no_number() -> None:
    names = Strings(codes=np.zeros(1, np.int32), table=("a",))
    with pytest.raises(LogError, match="column of strings"):
        expand(BatchLayout(samples=("s",), period=0.1), decoded({"s": Column(values=names)}, messages=1), ("s",), [0])


@pytest.mark.parametrize("order", ["channel", "sample"])
def test_counts_cut_an_array_of_all_columns(order: str) -> None:
    block = np.arange(8.0).reshape(2, 4)
    part = (block if order == "channel" else block.T).reshape(1, -1)
    columns = {"s": Column(values=np.repeat(part, 3, axis=0)), "n": Column(values=np.array([4, 3, -1]))}
    layout = BatchLayout(samples=("s",), period=0.1, names=("a", "b"), order=order, count="n")  # type: ignore[arg-type]
    found = expand(layout, decoded(columns, messages=3), ("a", "b"), [0, 1])
    np.testing.assert_array_equal(found.values, np.concatenate((block, block[:, :3]), axis=1))
    np.testing.assert_array_equal(found.bad, [False, False, True])


@pytest.mark.parametrize("odd", [0, 1, 4])
def test_names_of_columns_are_those_of_most_messages(odd: int) -> None:
    layout = BatchLayout(samples=("s",), period=0.1, names="names", units="units")
    codes = np.array([index == odd for index in range(5)], np.int32)
    columns = {
        "names": Column(values=Strings(codes=codes, table=(("a", "b"), ("a", "c")))),
        "units": Column(values=Strings(codes=codes, table=(("g", "N"), ("g", "M")))),
    }
    heads = [decoded(columns, messages=5)]
    assert column_names(layout, heads) == ("a", "b")
    assert column_units(layout, heads) == ("g", "N")
    assert column_names(layout, [decoded(columns, messages=5, bad=(0, 1, 2, 3, 4))]) == ()
