"""Servo valve: lag of its spool, dead zone of its overlap, saturation of its opening."""

from collections.abc import Mapping
from typing import Final

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.drives.equations import PlacedPort, Sum
from chladni.models.drives.limit_law import UNLIMITED, limit_law

#: Port between spool and opening, where dead zone and saturation act.
VALVE = "valve"

VALVE_PARAMETERS: Final = Parameters(
    (
        Parameter(
            name="valve_time", value=2e-3, unit="s", low=1e-3, high=2e-2, minimum=1e-6, maximum=10.0, symbol="T_v",
            shown_unit="ms", tolerance=0.2, meaning="time constant of the spool; 2 ms is a bandwidth of 80 Hz",
        ),
        # A servo valve is ground to a few percent; a proportional valve overlaps by up to a quarter.
        Parameter(
            name="valve_overlap", value=0.03, low=0.0, high=0.25, minimum=0.0, maximum=0.9, tolerance=0.3,
            meaning="half width of the dead zone over the rated flow",
        ),
    )
)  # fmt: skip

VALVE_ACTS_WITH: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "valve_time": ("valve_lag", ("on",)),
    "valve_overlap": ("dead_zone", ("on",)),
}


def valve_equations(
    values: Mapping[str, float], options: Mapping[str, str], *, command: str
) -> tuple[dict[str, Sum], dict[str, Sum], tuple[PlacedPort, ...]]:
    """Rates, signals and port of a valve; it makes the signal ``motor_flow`` of the flow commanded.

    ::

        T_v q' + q = command            with valve_lag, else q = command
        Q = sat(dead zone(q))           with dead_zone and saturation, else what is left of it
    """
    rates: dict[str, Sum] = {}
    # Dead zone and saturation belong to the opening: they act on where the spool is, not on what it's told.
    spool = command
    if options["valve_lag"] == "on":
        spool = "spool"
        rates[spool] = {command: 1 / values["valve_time"], spool: -1 / values["valve_time"]}
    limited, dead = options["saturation"] == "on", options["dead_zone"] == "on"
    # Without a law the drive stays linear, and exact.
    if not limited and not dead:
        return rates, {"motor_flow": {spool: 1.0}}, ()
    law = limit_law(
        half_width=values["valve_overlap"] * values["rated_flow"] if dead else 0.0,
        limit=values["rated_flow"] if limited else UNLIMITED,
    )
    port = Port(name=VALVE, kind="input", unit="m^3/s", displacement_unit="m^3/s")
    placed = PlacedPort(port=port, displacement={spool: 1.0}, velocity={}, laws=(law,))
    return rates, {"motor_flow": {spool: 1.0, placed.signal: 1.0}}, (placed,)
