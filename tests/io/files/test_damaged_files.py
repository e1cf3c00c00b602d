"""Wrong bytes in any data file: refused in one line, or read as what they say; never a crash, never another error."""

from pathlib import Path

import numpy as np
import pytest

from chladni.io.files.csv import read_csv, write_csv
from chladni.io.files.uff import read_uff, write_uff
from chladni.io.files.wav import read_wav, write_wav
from chladni.signals.channel import Channel
from chladni.signals.errors import ChladniError
from chladni.signals.time_series import TimeSeries

KINDS = {
    "csv": (read_csv, write_csv, {}),
    "wav": (read_wav, write_wav, {}),
    "binary": (read_uff, write_uff, {"binary": True}),
    "text": (read_uff, write_uff, {"binary": False}),
}
TYPICAL = b'0123456789-.eE \n,;"\x00\xff'


@pytest.mark.parametrize("kind", KINDS)
def test_wrong_bytes_never_crash(tmp_path: Path, kind: str) -> None:
    read, write, options = KINDS[kind]
    channels = (Channel(name="a", unit="N"), Channel(name="b", unit="m/s^2"))
    values = np.random.default_rng(4).standard_normal((2, 12))
    write(TimeSeries(values=values, sample_rate_hz=100.0, channels=channels), tmp_path / "a", **options)
    raw = (tmp_path / "a").read_bytes()
    rng = np.random.default_rng(2)
    refused = []
    for number in range(120):
        changed = bytearray(raw)
        for place in rng.integers(0, len(raw), 1 + number % 3):
            changed[place] = rng.choice(list(TYPICAL)) if number % 2 else rng.integers(256)
        (tmp_path / "b").write_bytes(changed[: rng.integers(1, len(raw))] if number % 5 == 0 else changed)
        try:
            read(tmp_path / "b")
        except ChladniError as error:
            refused.append(str(error))
    assert len(refused) > 12
    assert not any("\n" in message for message in refused)
