"""Where a model comes from: a file, or an instrument's name; and a log that drives it."""

from pathlib import Path

from chladni.io.log import open_log
from chladni.models.core.instrument import Instrument
from chladni.models.core.model import Model
from chladni.models.files.model_file import load_model
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.models.instruments.of_model import instrument_of
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries


def named_instrument(text: str) -> Instrument:
    """Give the instrument of this name, or one made of the model in a file; `ModelError` when `text` is neither."""
    return INSTRUMENTS[text] if text in INSTRUMENTS else instrument_of(_of_file(text))


def _of_file(text: str) -> Model:
    path = Path(text)
    if path.suffix or path.exists():
        return load_model(path)
    raise ModelError(f"{text}: no such file, and no instrument of this name; instruments: {', '.join(INSTRUMENTS)}")


def recording_for(model: Model, log: Path | str) -> TimeSeries:
    """Read the channels that a model's inputs name from a log, and those of its outputs that the log holds too.

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
    measured = {terminal.channel for terminal in compiled.outputs if terminal.channel is not None}
    with open_log(log) as opened:
        held = [channel.name for channel in opened.channels if channel.name in measured]
        return opened.read(list(dict.fromkeys([*driving, *held])))
