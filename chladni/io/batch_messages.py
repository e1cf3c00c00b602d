"""Batch messages: one message holds many samples of several columns (a DAQ block, an IMU's FIFO)."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.io.decoding.columns import Decoded, StringValue
from chladni.io.decoding.schema import FieldInfo
from chladni.io.known_schemas import message_type
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.errors import LogError

#: Time between samples that is believed: a gigahertz to a sample a day.
SHORTEST_S = 1e-9
LONGEST_S = 86_400.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchLayout:
    """How samples lie in a batch message.

    Attributes
    ----------
    samples
        Leaves with the samples: one for all columns together, or one for each column.
    period
        Leaf with the time between samples, or that time in seconds.
    period_unit
        Factor that brings the number to seconds, or to Hz.
    inverse
        The number is a rate, not a time.
    stamp
        Whether the message's stamp is the time of its first or of its last sample.
    names
        Leaf with the names of the columns, or the names, or None when `samples` names them.
    order
        ``channel``: all samples of the first column, then of the second; ``sample``: all columns of the first
        sample, then of the second.
    count
        Leaf with the number of samples that count, when the array may be longer; None when all count.
    scale
        Leaf with a factor, or the factor itself.
    units
        Leaf with a unit for each column, or None.
    unit
        Unit of all columns, or None.
    why
        What the layout was recognised by, for people.
    """

    samples: tuple[str, ...]
    period: str | float
    period_unit: float = 1.0
    inverse: bool = False
    stamp: Literal["first", "last"] = "first"
    names: str | tuple[str, ...] | None = None
    order: Literal["channel", "sample"] = "channel"
    count: str | None = None
    scale: str | float = 1.0
    units: str | None = None
    unit: str | None = None
    why: str = ""

    @property
    def leaves(self) -> tuple[str, ...]:
        """Every leaf that must be decoded."""
        optional = (self.period, self.names, self.count, self.scale, self.units)
        return tuple(dict.fromkeys((*self.samples, *(leaf for leaf in optional if isinstance(leaf, str)))))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Expanded:
    """Samples of a batch of messages.

    Attributes
    ----------
    values
        ``[column, sample]``, messages one after another; ``[column, 0]`` columns only when `counts` is all zero.
    counts
        ``[message]``, samples of each; 0 where the message is bad.
    periods_s
        ``[message]``, time between samples.
    bad
        ``[message]``, True where the message contradicts itself or the layout.
    """

    values: NDArray[np.floating]
    counts: Whole
    periods_s: Real
    bad: Mask


# --- recognising -------------------------------------------------------------------------------------------------


def recognised_layout(schema_name: str, fields: Sequence[FieldInfo]) -> BatchLayout | None:
    """Give the layout of the batch messages that need no setup file, or None.

    Known are px4_msgs' SensorAccelFifo and SensorGyroFifo, and any message with a rate (or dt), names of
    channels, and samples: ``sample_rate``, ``channel_names``, ``samples`` with all samples of a channel together.
    """
    kind = message_type(schema_name)
    leaves = {info.path: info for info in fields}
    if kind in ("px4_msgs/SensorAccelFifo", "px4_msgs/SensorGyroFifo") and {"x", "y", "z", "dt"} <= leaves.keys():
        # PX4 stamps a FIFO when it is read out, that is with the time of its newest sample; dt is in microseconds.
        return BatchLayout(
            samples=("x", "y", "z"),
            period="dt",
            period_unit=1e-6,
            stamp="last",
            count="samples" if "samples" in leaves else None,
            scale="scale" if "scale" in leaves else 1.0,
            why=f"{kind}: dt in microseconds, stamped at the newest sample",
        )
    return _sample_block(leaves)


def _sample_block(leaves: Mapping[str, FieldInfo]) -> BatchLayout | None:
    names, samples = leaves.get("channel_names"), leaves.get("samples")
    if names is None or names.kind != "string" or names.array is None:
        return None
    if samples is None or samples.kind != "number" or samples.array is None:
        return None
    for leaf, inverse in (("sample_rate", True), ("sample_rate_hz", True), ("dt", False)):
        period = leaves.get(leaf)
        if period is not None and period.kind in ("number", "duration") and period.array is None:
            units = leaves.get("units", leaves.get("channel_units"))
            return BatchLayout(
                samples=("samples",),
                period=leaf,
                period_unit=1e-9 if period.kind == "duration" else 1.0,
                inverse=inverse,
                names="channel_names",
                units=units.path if units is not None and units.kind == "string" and units.array else None,
                why=f"{leaf}, channel_names and samples make it a block of samples, channel after channel",
            )
    return None


def column_names(layout: BatchLayout, heads: Sequence[Decoded]) -> tuple[str, ...]:
    """Names of the columns, as most of the first good messages (or the layout) give them.

    Raises
    ------
    LogError
        When names repeat, so that a path could mean two columns.
    """
    match layout.names:
        case None:
            names = layout.samples
        case str(leaf):
            names = _usual_list(heads, leaf)
        case _:
            names = layout.names
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise LogError(
            f"batch message: the column name {repeated[0]!r} occurs {names.count(repeated[0])} times; "
            'give unique names in the setup file: [[batch]] names = ["...", ...]'
        )
    return names


def column_units(layout: BatchLayout, heads: Sequence[Decoded]) -> tuple[str, ...]:
    """Units of the columns as most of the first good messages give them; empty when they give none."""
    return () if layout.units is None else _usual_list(heads, layout.units)


def _usual_list(heads: Sequence[Decoded], leaf: str) -> tuple[str, ...]:
    """The list of strings that most messages have; one that says otherwise may be damaged."""
    found = Counter[StringValue]()
    for decoded in heads:
        strings = decoded.columns[leaf].strings
        found.update(strings.table[code] for code in strings.codes[~decoded.bad].tolist())
    for entry, _ in found.most_common(1):
        return (entry,) if isinstance(entry, str) else entry
    return ()


# --- expanding ---------------------------------------------------------------------------------------------------


def expand(layout: BatchLayout, decoded: Decoded, names: tuple[str, ...], wanted: Sequence[int]) -> Expanded:
    """Lay out the samples of all messages one after another.

    Parameters
    ----------
    layout
        How they lie in the message.
    decoded
        Columns with all `layout.leaves`.
    names
        Names of all columns; messages with other names are bad.
    wanted
        Columns to give out, by index into `names`.
    """
    periods_s = _periods_s(layout, decoded)
    bad = decoded.bad | ~((periods_s >= SHORTEST_S) & (periods_s <= LONGEST_S)) | _renamed(layout, decoded, names)
    if len(layout.samples) == 1 and len(names) > 1:
        values, counts = _split(layout, decoded, len(names), wanted, bad)
    else:
        values, counts = _side_by_side(layout, decoded, wanted, bad)
    bad |= counts < 0
    counts = np.where(bad, 0, counts)
    return Expanded(values=_scaled(layout, decoded, values, counts), counts=counts, periods_s=periods_s, bad=bad)


def _periods_s(layout: BatchLayout, decoded: Decoded) -> Real:
    if isinstance(layout.period, str):
        raw = decoded.columns[layout.period].numbers.astype(np.float64) * layout.period_unit
    else:
        raw = np.full(len(decoded.bad), layout.period * layout.period_unit)
    if not layout.inverse:
        return raw
    return np.divide(1.0, raw, out=np.zeros_like(raw), where=raw > 1 / LONGEST_S)


def _renamed(layout: BatchLayout, decoded: Decoded, names: tuple[str, ...]) -> Mask:
    if not isinstance(layout.names, str):
        return np.zeros(len(decoded.bad), np.bool_)
    strings = decoded.columns[layout.names].strings
    other = [(entry if isinstance(entry, tuple) else (entry,)) != names for entry in strings.table]
    return np.array(other, np.bool_)[strings.codes]


def _split(
    layout: BatchLayout, decoded: Decoded, width: int, wanted: Sequence[int], bad: Mask
) -> tuple[NDArray[Any], Whole]:
    """One array holds all columns; -1 as count where its length doesn't divide by their number."""
    column = decoded.columns[layout.samples[0]]
    flat, elements = column.per_message()
    room = elements // width
    counts = np.where(elements % width == 0, _said_counts(layout, decoded, room), -1)
    if column.counts is None and not bad.any() and np.array_equal(counts, room):
        shape = (len(bad), width, -1) if layout.order == "channel" else (len(bad), -1, width)
        axes = (1, 0, 2) if layout.order == "channel" else (2, 0, 1)
        cube = flat.reshape(shape).transpose(axes)
        chosen = cube if list(wanted) == list(range(width)) else cube[list(wanted)]
        return chosen.reshape(len(wanted), counts.sum()), counts
    usable = np.where(bad, 0, np.maximum(counts, 0))
    starts = np.repeat(np.cumsum(elements) - elements, usable)
    within = np.arange(usable.sum()) - np.repeat(np.cumsum(usable) - usable, usable)
    stride = np.repeat(room, usable)
    rows = [
        flat[starts + (row * stride + within if layout.order == "channel" else within * width + row)]
        for row in wanted
    ]
    return _stacked(rows, flat, int(usable.sum())), counts


def _said_counts(layout: BatchLayout, decoded: Decoded, room: Whole) -> Whole:
    """Samples of each message as it says itself, all there's room for when it says nothing; -1 where it lies."""
    if layout.count is None:
        return room
    said = decoded.columns[layout.count].numbers.astype(np.float64)
    return np.where((said >= 0) & (said <= room), said, -1).astype(np.int64)


def _stacked(rows: list[NDArray[Any]], like: NDArray[Any], samples: int) -> NDArray[Any]:
    return np.stack(rows) if rows else np.empty((0, samples), like.dtype)


def _side_by_side(
    layout: BatchLayout, decoded: Decoded, wanted: Sequence[int], bad: Mask
) -> tuple[NDArray[Any], Whole]:
    """An array for each column; -1 as count where they differ in length or are shorter than the message says."""
    every = [decoded.columns[leaf].per_message() for leaf in layout.samples]
    lengths = np.stack([elements for _, elements in every])
    same = (lengths == lengths[0]).all(axis=0)
    counts = np.where(same, _said_counts(layout, decoded, lengths[0]), -1)
    usable = np.where(bad, 0, np.maximum(counts, 0))
    within = np.arange(usable.sum()) - np.repeat(np.cumsum(usable) - usable, usable)
    rows = []
    for flat, elements in (every[row] for row in wanted):
        # Each column has its own starts: in a message that is bad they differ in length.
        rows.append(flat[np.repeat(np.cumsum(elements) - elements, usable) + within])
    return _stacked(rows, every[0][0], within.size), counts


def _scaled(layout: BatchLayout, decoded: Decoded, values: NDArray[Any], counts: Whole) -> NDArray[np.floating]:
    """Floating point, scaled; single precision stays single, since a log of it is half the size in memory."""
    floating = values if values.dtype in (np.float32, np.float64) else values.astype(np.float64)
    if isinstance(layout.scale, str):
        factors = decoded.columns[layout.scale].numbers.astype(np.float64)
        return floating * np.repeat(factors, counts)
    return floating if layout.scale == 1.0 else floating * floating.dtype.type(layout.scale)
