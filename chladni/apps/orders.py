"""Order tracking of a log: the shaft's rotation, maps of all orders, cuts of some."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from chladni.apps.sources import Span, WholeChannels, moving_channels, whole_channels
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.errors import EstimateError
from chladni.signals.order_spectra import OrderCuts, OrderMap, OrderMethod
from chladni.signals.rotation import Rotation
from chladni.signals.time_series import TimeSeries
from chladni.spectral.orders import order_cuts, order_map, strongest_orders
from chladni.spectral.rotation import rotation

# As many as are told apart in one picture.
ORDERS_TOLD = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OrderStudy:
    """What ``chladni orders`` tells: maps and cuts, one of each a sampling grid."""

    rotation: Rotation
    maps: tuple[OrderMap, ...]
    cuts: tuple[OrderCuts, ...]


def track_orders(
    log: Log,
    *,
    shaft: str,
    channels: Sequence[str] | None,
    orders: Sequence[float] | None,
    method: OrderMethod,
    revolutions: float | None,
    highest_order: float | None,
    span: Span,
    telling: str,
    **how: Any,
) -> OrderStudy:
    """Track orders of named channels, or of all accelerations; without any, of all that don't tell the shaft.

    Parameters
    ----------
    log
        Of a large one, some channels are in memory at a time.
    shaft
        Message path of the channel that tells the rotation.
    channels
        Message paths; None for all accelerations.
    orders
        Multiples of the speed of rotation; None for the strongest in the map.
    method, revolutions, highest_order
        As for `order_cuts` and `order_map`; None for their defaults.
    span
        Which part of the log.
    telling, how
        As what `shaft` tells the rotation, such as ``tacho``, and further arguments of `rotation`.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no channel is left to track, or an argument is out of its range.
    """
    name = log.name(shaft)
    grids = whole_channels(log, [name], span, work="order tracking")
    ((told,),) = grids
    try:
        turned = rotation(told, **({telling: name} | how))
        # A ridge is a vibration itself.
        names = _tracked(log, channels, () if turned.source == "ridge" else (name,), span)
        parts = whole_channels(log, names, span, work="order tracking")
        window: dict[str, Any] = {} if revolutions is None else {"revolutions": revolutions}
        maps = _of_moving(parts, lambda series: order_map(series, turned, highest_order=highest_order, **window))
        _require_moving(names, maps)
        wanted = strongest_orders(maps, count=ORDERS_TOLD) if orders is None else orders
        cuts = _of_moving(parts, lambda series: order_cuts(series, turned, orders=wanted, method=method, **window))
        _require_shown(cuts)
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error
    return OrderStudy(rotation=turned, maps=maps, cuts=cuts)


def _require_moving(names: Sequence[str], maps: Sequence[OrderMap]) -> None:
    if not maps:
        raise EstimateError(f"{some_of(names)} never changes, so it has no orders; name another channel (--channel)")


def _require_shown(cuts: Sequence[OrderCuts]) -> None:
    """Raise `EstimateError` when an order is beyond what the samples show at every speed."""
    for place, order in enumerate(cuts[0].orders.tolist() if cuts else ()):
        if not any(np.isfinite(one.values[:, place]).any() for one in cuts):
            slowest_hz = min(float(one.speed_hz.min()) for one in cuts)
            raise EstimateError(
                f"order {order:g} is above what the samples show: at {slowest_hz:.4g} Hz, the slowest, it lies at "
                f"{order * slowest_hz:.4g} Hz; ask for a lower order"
            )


_Orders = TypeVar("_Orders", OrderMap, OrderCuts)


def _of_moving(grids: Sequence[WholeChannels], estimate: Callable[[TimeSeries], _Orders]) -> tuple[_Orders, ...]:
    """Estimate of each grid, without what never changes: all that its orders would show is rounding."""

    def of_part(series: TimeSeries) -> _Orders | None:
        moving = moving_channels(series)
        return estimate(series.select(moving)) if moving else None

    found: list[_Orders] = []
    for grid in grids:
        parts = filter(None, map(of_part, grid))
        # All parts after the first are joined to it.
        found += [_together(first, parts, most=len(grid.names)) for first in parts]
    return tuple(found)


def _together(first: _Orders, others: Iterator[_Orders], *, most: int) -> _Orders:
    """Join what was found of some channels of a grid each, of at most so many."""
    # In place: many channels' maps take much memory, and as much again to join them afterwards.
    values = np.empty((most, *first.values.shape[1:]), first.values.dtype)
    values[: len(first.channels)] = first.values
    channels = list(first.channels)
    joined = replace(first, values=values[:0], channels=())
    for one in others:
        values[len(channels) : len(channels) + len(one.channels)] = one.values
        channels += one.channels
    return replace(joined, values=values[: len(channels)], channels=tuple(channels))


def _tracked(log: Log, channels: Sequence[str] | None, shaft: Sequence[str], span: Span) -> tuple[str, ...]:
    """Names of the channels that were asked for; else of all accelerations, or of all but the shaft's."""
    if channels is not None:
        return log.names(channels)
    units = {channel.name: channel.unit for channel in log.channels}
    grids = log.grids(None, start_s=span.start_s, end_s=span.end_s)
    others = tuple(name for grid in grids for name in grid.names if name not in shaft)
    # A log holds much beside vibration, such as commands and temperatures.
    accelerations = tuple(name for name in others if units[name] == "m/s^2")
    if not others:
        raise EstimateError(f"no channel but {some_of(list(shaft))} is there; a vibration is needed beside it")
    return accelerations or others
