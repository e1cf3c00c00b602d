"""The instruments there are, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from chladni.models.core.instrument import Instrument
from chladni.models.instruments import (
    dc_servo,
    hydraulic_motor,
    mr_damper,
    pneumatic_motor,
    robot_arm,
    robot_module,
)
from chladni.models.instruments.elements import ELEMENT_INSTRUMENTS

#: Drives, damper, block scheme and structure, then the elements of which schemes are built.
INSTRUMENTS: Mapping[str, Instrument] = MappingProxyType(
    {
        instrument.name: instrument
        for instrument in (
            pneumatic_motor.INSTRUMENT,
            hydraulic_motor.INSTRUMENT,
            dc_servo.INSTRUMENT,
            mr_damper.INSTRUMENT,
            robot_module.INSTRUMENT,
            robot_arm.INSTRUMENT,
            *ELEMENT_INSTRUMENTS.values(),
        )
    }
)
