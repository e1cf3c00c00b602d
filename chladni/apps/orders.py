"""Order tracking of a log: the shaft's rotation, maps of all orders, cuts of some."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from chladni.apps.sources import Span, moving_channels, require_fitting
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
        Read into memory.
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
    require_fitting(log, None if channels is None else [name, *log.names(channels)], span, work="order tracking")
    (told,) = log.read_groups([name], start_s=span.start_s, end_s=span.end_s)
    try:
        turned = rotation(told, **({telling: name} | how))
        # A ridge is a vibration itself.
        series = _moving(_tracked(log, channels, () if turned.source == "ridge" else (name,), span))
        window: dict[str, Any] = {} if revolutions is None else {"revolutions": revolutions}
        maps = tuple(order_map(one, turned, highest_order=highest_order, **window) for one in series)
        wanted = strongest_orders(maps, count=ORDERS_TOLD) if orders is None else orders
        cuts = tuple(order_cuts(one, turned, orders=wanted, method=method, **window) for one in series)
        _require_shown(cuts)
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error
    return OrderStudy(rotation=turned, maps=maps, cuts=cuts)


def _require_shown(cuts: Sequence[OrderCuts]) -> None:
    """Raise `EstimateError` when an order is beyond what the samples show at every speed."""
    for place, order in enumerate(cuts[0].orders.tolist() if cuts else ()):
        if not any(np.isfinite(one.values[:, place]).any() for one in cuts):
            slowest_hz = min(float(one.speed_hz.min()) for one in cuts)
            raise EstimateError(
                f"order {order:g} is above what the samples show: at {slowest_hz:.4g} Hz, the slowest, it lies at "
                f"{order * slowest_hz:.4g} Hz; ask for a lower order"
            )


def _moving(groups: Sequence[TimeSeries]) -> tuple[TimeSeries, ...]:
    """Leave out what never changes: all that its orders would show is rounding."""
    kept = [moving_channels(one) for one in groups]
    if not any(kept):
        still = [channel.name for one in groups for channel in one.channels]
        raise EstimateError(f"{some_of(still)} never changes, so it has no orders; name another channel (--channel)")
    return tuple(one.select(names) for one, names in zip(groups, kept, strict=True) if names)


def _tracked(log: Log, channels: Sequence[str] | None, shaft: Sequence[str], span: Span) -> tuple[TimeSeries, ...]:
    groups = log.read_groups(channels, start_s=span.start_s, end_s=span.end_s)
    if channels is not None:
        return groups
    others = [[c for c in one.channels if c.name not in shaft] for one in groups]
    # A log holds much beside vibration, such as commands and temperatures.
    accelerations = [[c for c in some if c.unit == "m/s^2"] for some in others]
    chosen = accelerations if any(accelerations) else others
    if not any(chosen):
        raise EstimateError(f"no channel but {some_of(list(shaft))} is there; a vibration is needed beside it")
    return tuple(
        one.select([channel.name for channel in some]) for one, some in zip(groups, chosen, strict=True) if some
    )
