"""Samples that are no numbers are told by whatever reads them: how many, of which channel, and when."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import chladni
from chladni.cli.main import app
from chladni.io.missing_samples import MissingSamples

RATE_HZ, SAMPLES = 100.0, 1000
#: Of channel a, by where they lie: the samples that are no numbers, and how that is told.
PLACES = {
    "start": (slice(0, 70), "a: 70 of 1000 samples are missing between 0 and 0.69 s"),
    "first": (slice(0, 1), "a: 1 of 1000 samples is missing at 0 s"),
    "middle": (slice(400, 450), "a: 50 of 1000 samples are missing between 4 and 4.49 s"),
    "end": (slice(990, None), "a: 10 of 1000 samples are missing between 9.9 and 9.99 s"),
}


def samples(where: slice, value: float = np.nan) -> dict[str, np.ndarray]:
    a, b = np.random.default_rng(1).standard_normal((2, SAMPLES))
    a[where] = value
    return {"a": a, "b": b}


def written(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    """Write channels with their times, as NPZ or CSV."""
    time_s = np.arange(SAMPLES) / RATE_HZ
    if path.suffix == ".npz":
        np.savez(path, time=time_s, **arrays)
    else:
        rows = zip(time_s, *arrays.values(), strict=True)
        path.write_text("time [s],a [m/s^2],b [m/s^2]\n" + "".join(f"{t:.2f},{a},{b}\n" for t, a, b in rows))
    return path


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
@pytest.mark.parametrize("where", PLACES)
def test_a_log_tells_what_is_missing_in_what_was_read(tmp_path: Path, where: str, suffix: str) -> None:
    place, told = PLACES[where]
    log = chladni.open(written(tmp_path / f"x{suffix}", samples(place)))
    log.read("b")
    assert not any("missing" in note for note in log.notes)
    log.read()
    assert any(note.startswith(told) for note in log.notes)


def test_messages_that_hold_no_number_are_told_too(tmp_path: Path) -> None:
    series = chladni.TimeSeries.from_arrays(samples(slice(0, 70)), sample_rate_hz=RATE_HZ)
    chladni.write_mcap(series, tmp_path / "x.mcap")
    log = chladni.open(tmp_path / "x.mcap")
    for _ in log.blocks(seconds=3.0):
        pass
    assert log.notes[0].startswith("/a.value: 70 of 1000 samples are missing between 0 and 0.69 s")


@pytest.mark.parametrize("verb", ["psd", "levels", "waterfall", "info"])
def test_commands_tell_rows_without_a_number_at_the_very_start(tmp_path: Path, verb: str) -> None:
    arrays = samples(slice(0, 70))
    arrays["b"][:70] = np.nan
    path = written(tmp_path / "x.csv", arrays)
    told = CliRunner().invoke(app, [verb, str(path)])
    assert told.exit_code == 0, told.output
    assert "a, b: 70 of 1000 samples" in told.output


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_values_of_arrays_tell_it(value: float) -> None:
    arrays = samples(slice(0, 70), value)
    for verb in (chladni.levels, chladni.srs, chladni.probability_density):
        assert PLACES["start"][1] in verb(arrays, sample_rate_hz=RATE_HZ).notes[0]
    fall = chladni.waterfall(arrays, sample_rate_hz=RATE_HZ)
    assert PLACES["start"][1] in fall.provenance.notes[0]
    (first, _) = chladni.envelope(arrays, sample_rate_hz=RATE_HZ, band_hz=(10.0, 30.0))
    assert PLACES["start"][1] in first.notes[-1]


def test_a_channel_without_one_number_is_named() -> None:
    with pytest.raises(chladni.EstimateError, match=r"^a: not one sample is a number; leave it out"):
        chladni.psd(samples(slice(None)), sample_rate_hz=RATE_HZ)


def test_many_channels_are_told_in_few_lines() -> None:
    values = np.zeros((9, 20))
    for row in range(9):
        values[row, : row + 1] = np.nan
    book = MissingSamples()
    for _ in book.watch(chladni.TimeSeries.from_arrays(values, sample_rate_hz=1.0)):
        pass
    told = book.sentences(from_ns=0)
    assert len(told) == 6
    assert told[-1].startswith("4 more channels")
