"""Where a model comes from: a file, or an instrument's name; and a log that drives it."""

from dataclasses import replace
from pathlib import Path

from chladni.apps.findings import reading_sentences
from chladni.io.log import Log
from chladni.models.core.instrument import Instrument
from chladni.models.core.model import Model
from chladni.models.drives.drive_model import DriveModel
from chladni.models.files.model_file import load_model
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.models.instruments.of_model import instrument_of
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries
from chladni.signals.visible import visible
from chladni.signals.wording import near_words


def named_instrument(text: str) -> Instrument:
    """Give the instrument of this name, or one made of the model in a file; `ModelError` when `text` is neither."""
    return INSTRUMENTS[text] if text in INSTRUMENTS else _with_usual_step(_of_file(text))


def _of_file(text: str) -> Model:
    path = Path(text)
    if path.suffix or path.exists():
        return load_model(path)
    near = near_words(text, INSTRUMENTS)
    told = f"did you mean {near[0]}?" if near else f"instruments: {', '.join(INSTRUMENTS)}"
    raise ModelError(f"{text}: no such file, and no instrument of this name; {told}")


def _with_usual_step(model: Model) -> Instrument:
    """Make an instrument; a drive steps by as much as on its own page, since one m^3/s would burst any valve."""
    made = instrument_of(model)
    usual = INSTRUMENTS.get(model.drive.name) if isinstance(model, DriveModel) else None
    if usual is None:
        return made
    same_unit = _unit(model, made.step_input) == _unit(usual.model(), usual.step_input)
    return replace(made, step_size=usual.step_size) if same_unit else made


def _unit(model: Model, name: str) -> str | None:
    return next((terminal.unit for terminal in model.compile().inputs if terminal.name == name), None)


def recording_for(model: Model, log: Log) -> tuple[TimeSeries, tuple[str, ...]]:
    """Read the channels that a model's inputs name from a log, and those of its outputs that the log holds too.

    Returns
    -------
    recording, damage
        The samples, and sentences on what wasn't read: a log that was cut off drives the model as far as it goes.

    Raises
    ------
    ModelError
        When no input of the model names a channel.
    LogError
        When the log hasn't got an input's channel, or channels don't share a grid.
    """
    compiled = model.compile()
    driving = [terminal.channel for terminal in compiled.inputs if terminal.channel is not None]
    if not driving:
        raise ModelError(
            f"model {model.name!r}: no input names a channel of a log; give its [[input]] a line such as "
            'channel = "/hammer.wrench.force.x"'
        )
    measured = {visible(terminal.channel) for terminal in compiled.outputs if terminal.channel is not None}
    held = [channel.name for channel in log.channels if visible(channel.name) in measured]
    recording = log.read(list(dict.fromkeys([*driving, *held])))
    return recording, reading_sentences(log, everything=False)
