"""What the instruments of drives share."""

from collections.abc import Mapping, Sequence
from typing import Final

from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.drive_model import DriveModel, drive_model
from chladni.models.drives.selection import ChosenSignal

#: Name on a page of the input that a person turns, whatever the loop that is closed makes of it.
COMMAND: Final = "command"


def drive_at(
    kind: DriveKind,
    values: Mapping[str, float],
    options: Mapping[str, str],
    *,
    inputs: Sequence[ChosenSignal] = (),
    outputs: Sequence[ChosenSignal] = (),
) -> DriveModel:
    """Build a drive from the values of all knobs of its page, those of options that are off among them."""
    acting = kind.acting(options)
    chosen = {name: value for name, value in values.items() if name in acting}
    return drive_model(kind, chosen, options, inputs=inputs, outputs=outputs)
