"""``chladni orders``: vibration in multiples of a shaft's speed."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from chladni.cli import options
from chladni.cli.opening import Opener, opens_files
from chladni.cli.output import Output
from chladni.cli.words import number, unit

if TYPE_CHECKING:
    from chladni.signals.order_spectra import OrderCuts

RPM = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaft:
    """What tells the shaft's rotation."""

    tacho: Annotated[
        str | None, typer.Option(metavar="NAME", help="Channel of pulses of the shaft.", show_default=False)
    ] = None
    pulses: Annotated[float, typer.Option(metavar="N", help="Pulses a revolution.")] = 1.0
    threshold: Annotated[
        float | None,
        typer.Option(metavar="LEVEL", help="What a pulse passes; midway if not given.", show_default=False),
    ] = None
    phase: Annotated[
        str | None, typer.Option(metavar="NAME", help="Channel of the shaft's angle.", show_default=False)
    ] = None
    speed: Annotated[
        str | None, typer.Option(metavar="NAME", help="Channel of the shaft's speed.", show_default=False)
    ] = None
    ridge: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="A vibration that tells it by one of its orders.", show_default=False),
    ] = None
    ridge_order: Annotated[float, typer.Option(metavar="ORDER", help="Which order the ridge is.")] = 1.0
    ridge_band: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LO-HI", help="Where the ridge runs, in Hz.", show_default=False),
    ] = None

    def telling(self) -> tuple[str, str]:
        """Give the channel that tells the shaft, and how."""
        from chladni.signals.errors import SetupError

        named = {"tacho": self.tacho, "phase": self.phase, "speed": self.speed, "ridge": self.ridge}
        given = [(path, how) for how, path in named.items() if path is not None]
        if len(given) != 1:
            flags = ", ".join(f"--{how}" for how in named)
            raise SetupError(f"name exactly one channel that tells the shaft's rotation: {flags}")
        return given[0]


@opens_files
def orders(
    log: options.Log,
    *,
    shaft: Shaft,
    order: Annotated[
        list[float] | None,
        typer.Option(
            metavar="ORDER", help="Cut this order; may be repeated. The strongest if not given.", show_default=False
        ),
    ] = None,
    channel: options.Channels = None,
    method: Annotated[
        Literal["angle", "vold-kalman"],
        typer.Option(help="Windows over the angle, or a filter that parts close orders."),
    ] = "angle",
    revolutions: Annotated[
        float | None,
        typer.Option(metavar="N", help="Length of a window; 8 for cuts and 10 for maps if not given."),
    ] = None,
    highest: Annotated[
        float | None, typer.Option(metavar="ORDER", help="Highest order of the map.", show_default=False)
    ] = None,
    part: options.Part,
    opener: Opener,
    json: options.Json = None,
    csv: options.Csv = None,
    figures: options.Figures = None,
) -> None:
    """Orders of a rotating machine: amplitude and phase over its speed."""
    from chladni.apps.documents import orders_document
    from chladni.apps.findings import reading_sentences
    from chladni.apps.orders import track_orders

    out = Output.of_log([log, opener.setup], json=json, csv=csv, figures=figures)
    channel_of_shaft, telling = shaft.telling()
    with opener(log) as opened:
        found = track_orders(
            opened,
            shaft=channel_of_shaft,
            channels=channel,
            orders=order,
            method=method,
            revolutions=revolutions,
            highest_order=highest,
            span=part.span(),
            telling=telling,
            pulses_a_revolution=shaft.pulses,
            threshold=shaft.threshold,
            ridge_order=shaft.ridge_order,
            ridge_hz=shaft.ridge_band,
        )
        told = reading_sentences(opened, everything=channel is None)
    for cuts in found.cuts:
        _print_cuts(out, cuts)
    out.lines((*told, *found.rotation.notes))
    out.csv(found.cuts)
    if figures is not None:
        from chladni.viewers.figures.orders import order_figures

        out.figures("orders", order_figures(found.maps, found.cuts), figures)
    out.json(orders_document, found)


def _print_cuts(out: Output, cuts: "OrderCuts") -> None:
    import numpy as np

    slowest, fastest = RPM * float(cuts.speed_hz.min()), RPM * float(cuts.speed_hz.max())
    rows = []
    for row, channel in enumerate(cuts.channels):
        for place, order in enumerate(cuts.orders.tolist()):
            size = np.abs(cuts.values[row, place])
            if not np.isfinite(size).any():
                continue
            at = int(np.nanargmax(size))
            speed_hz = float(cuts.speed_hz[at])
            rows.append(
                [
                    channel.name,
                    number(order),
                    number(float(size[at])),
                    unit(channel.unit),
                    number(RPM * speed_hz),
                    number(order * speed_hz),
                    number(float(cuts.time_s[at])),
                ]
            )
    out.channel_table(
        f"Orders from {number(slowest)} to {number(fastest)} rpm, where each is highest",
        ["channel", "order", "peak amplitude", "unit", "at [rpm]", "frequency [Hz]", "time [s]"],
        rows,
    )
