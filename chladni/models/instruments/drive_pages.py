"""What the instruments of drives share."""

from collections.abc import Mapping

from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.drive_model import DriveModel, drive_model


def drive_at(kind: DriveKind, values: Mapping[str, float], options: Mapping[str, str]) -> DriveModel:
    """Build a drive from the values of all knobs of its page, those of options that are off among them."""
    acting = kind.acting(options)
    return drive_model(kind, {name: value for name, value in values.items() if name in acting}, options)
