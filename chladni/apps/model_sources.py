"""Where a model comes from: a file, or an instrument's name; and a log that drives it."""

from collections.abc import Sequence
from pathlib import Path

from chladni.io.log import open_log
from chladni.models.core.instrument import Instrument
from chladni.models.core.model import Model
from chladni.models.files.model_file import load_model
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.models.instruments.of_model import instrument_of
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries


def named_model(text: str) -> Model:
    """Give the model of a file, or of an instrument at its defaults; `ModelError` when `text` is neither."""
    return named_instrument(text).model() if text in INSTRUMENTS else _of_file(text)


def named_instrument(text: str) -> Instrument:
    """Give the instrument of this name, or one made of the model in a file; `ModelError` when `text` is neither."""
    return INSTRUMENTS[text] if text in INSTRUMENTS else instrument_of(_of_file(text))


def _of_file(text: str) -> Model:
    path = Path(text)
    if path.suffix or path.exists():
        return load_model(path)
    raise ModelError(f"{text}: no such file, and no instrument of this name; instruments: {', '.join(INSTRUMENTS)}")


def recording_for(model: Model, log: Path | str, *, others: Sequence[str] = ()) -> TimeSeries:
    """Read the channels of a log that a model's inputs name, and `others`, at one rate.

    Raises
    ------
    ModelError
        When no input of the model names a channel.
    LogError
        When the log hasn't got one.
    """
    channels = [terminal.channel for terminal in model.compile().inputs if terminal.channel is not None]
    if not channels:
        raise ModelError(
            f"model {model.name!r}: no input names a channel of a log; give its [[input]] a line such as "
            'channel = "/hammer.wrench.force.x"'
        )
    with open_log(log) as opened:
        return opened.read([*dict.fromkeys([*channels, *others])])
