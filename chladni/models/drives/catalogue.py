"""The kinds of drive that there are, by the word that files and commands use."""

from collections.abc import Mapping
from types import MappingProxyType

from chladni.models.drives.dc_servo import DC_SERVO
from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.hydraulic_motor import HYDRAULIC_MOTOR
from chladni.models.drives.mr_damper import MR_DAMPER
from chladni.models.drives.pneumatic_motor import PNEUMATIC_MOTOR

# A kind joins by standing in this tuple.
_KINDS: tuple[DriveKind, ...] = (PNEUMATIC_MOTOR, HYDRAULIC_MOTOR, DC_SERVO, MR_DAMPER)

DRIVES: Mapping[str, DriveKind] = MappingProxyType({kind.name: kind for kind in _KINDS})
