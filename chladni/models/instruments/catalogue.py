"""The instruments there are, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from chladni.models.core.instrument import Instrument
from chladni.models.instruments import (
    dc_servo,
    hydraulic_motor,
    pneumatic_motor,
    robot_arm,
)

#: In the order of the paper: drives, structure.
INSTRUMENTS: Mapping[str, Instrument] = MappingProxyType(
    {
        instrument.name: instrument
        for instrument in (
            pneumatic_motor.INSTRUMENT,
            hydraulic_motor.INSTRUMENT,
            dc_servo.INSTRUMENT,
            robot_arm.INSTRUMENT,
        )
    }
)
