"""A simulated log against a measured one."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.apps.gap_by_level import by_level_document, gap_by_level
from chladni.apps.gap_comparison import GapComparison, answer, compare_with_simulated, comparison_document
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.engineering import percent
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries
from chladni.viewers.gap_tables import split_table
from tests import made_diagnosis as made


def simulated() -> TimeSeries:
    run = made.nominal_run()
    values = np.vstack([run.inputs.values, run.outputs.values])
    return replace(made.log_series(), values=values)


def compared(measured: Path, other: Path, **span: float) -> GapComparison:
    with open_log(measured) as ours, open_log(other) as theirs:
        return compare_with_simulated(ours, theirs, **span)


@pytest.fixture
def logs(tmp_path: Path) -> tuple[Path, Path]:
    write_mcap(made.log_series(), tmp_path / "measured.mcap")
    write_mcap(simulated(), tmp_path / "simulated.mcap")
    return tmp_path / "measured.mcap", tmp_path / "simulated.mcap"


def test_the_gap_is_what_the_simulation_leaves(logs: tuple[Path, Path]) -> None:
    found = compared(*logs)
    assert found.gap == pytest.approx(made.pooled(made.measured() - made.nominal_run().outputs.values), rel=1e-6)
    assert found.inputs == ("/shaker.wrench.force.x",)
    assert {channel.name for channel in found.where.channels} == {"/column.accel.linear.x", "/wrist.accel.linear.x"}
    assert found.noise < found.gap
    first, *others = found.where.channels
    for bound, told in ((False, "noise "), (True, "noise at most ")):
        sure = (replace(one, noise_at_most=False) for one in others)
        where = replace(found.where, channels=(replace(first, noise_at_most=bound), *sure))
        assert answer(replace(found, where=where))[0].endswith(f"{told}{percent(found.noise)}.")
    assert found.where.sites == ()


def test_an_input_that_was_written_with_four_digits_is_one(logs: tuple[Path, Path], tmp_path: Path) -> None:
    theirs = simulated()
    # A CSV between the simulator and the log.
    write_mcap(replace(theirs, values=np.round(theirs.values, 2)), tmp_path / "rounded.mcap")
    assert compared(logs[0], tmp_path / "rounded.mcap").inputs == ("/shaker.wrench.force.x",)


def test_a_part_is_compared_alone(logs: tuple[Path, Path]) -> None:
    found = compared(*logs, start_s=2.0, end_s=6.0)
    part = slice(round(2 * made.RATE_HZ), round(6 * made.RATE_HZ))
    measured, nominal = made.measured()[:, part], made.nominal_run().outputs.values[:, part]
    error = np.mean((measured - nominal) ** 2, axis=1) / np.mean(measured**2, axis=1)
    assert found.gap == pytest.approx(np.sqrt(error.mean()), rel=1e-6)


def test_the_document_holds_where_and_how_far(logs: tuple[Path, Path]) -> None:
    document = json.loads(json.dumps(comparison_document(compared(*logs)), allow_nan=False))
    assert document["format"] == "chladni.gap-comparison/1"
    assert (document["simulated"], document["logs"]) == ("simulated.mcap", ["measured.mcap"])
    assert set(document["where"]) == {"channels", "bands", "sites", "regimes", "times"}
    assert set(document["gap"]) == {"before", "noise"}


def test_logs_of_different_things_are_told(logs: tuple[Path, Path], tmp_path: Path) -> None:
    other = replace(made.drive().channels[0], name="/fan.speed.x")
    write_mcap(made.drive().with_channels([other]), tmp_path / "fan.mcap")
    with pytest.raises(LogError, match="share no channel"):
        compared(logs[0], tmp_path / "fan.mcap")
    with pytest.raises(LogError, match="is the same"):
        compared(logs[0], logs[0])


def test_rates_that_differ_are_told(logs: tuple[Path, Path], tmp_path: Path) -> None:
    write_mcap(replace(simulated(), sample_rate_hz=400.0), tmp_path / "slow.mcap")
    with pytest.raises(LogError, match="500 Hz"):
        compared(logs[0], tmp_path / "slow.mcap")


def test_when_the_gap_lies_is_told_from_the_logs_start(logs: tuple[Path, Path], tmp_path: Path) -> None:
    series, first = made.log_series(), round(5.0 * made.RATE_HZ)
    values = series.values.copy()
    values[1:, first : first + 500] *= 1.5
    write_mcap(replace(series, values=values), tmp_path / "off.mcap")
    for span in ({}, {"start_s": 2.0}):
        (time,) = compared(logs[0], tmp_path / "off.mcap", **span).where.times
        assert (time.start_s, time.end_s) == (pytest.approx(5.0, abs=0.13), pytest.approx(6.0, abs=0.13))


def test_what_the_logs_cannot_tell_of_distortion_has_its_reason(logs: tuple[Path, Path], tmp_path: Path) -> None:
    # One period only.
    assert any("take one input that repeats" in remark for remark in compared(*logs).remarks)
    noisy = simulated().values + np.random.default_rng(1).standard_normal((3, 4000))
    write_mcap(replace(simulated(), values=noisy), tmp_path / "noisy.mcap")
    found = compared(logs[0], tmp_path / "noisy.mcap")
    assert (found.inputs, found.distortion) == ((), ())
    assert any("no channel that moves is the same" in remark for remark in found.remarks)


def test_channels_that_stand_still_are_no_inputs_to_tell_of(logs: tuple[Path, Path], tmp_path: Path) -> None:
    still = Channel(name="/shaker.wrench.force.y", unit="N")
    for series, name in ((made.log_series(), "ours"), (simulated(), "theirs")):
        values = np.vstack([series.values, np.zeros(series.samples)])
        write_mcap(replace(series, values=values, channels=(*series.channels, still)), tmp_path / f"{name}.mcap")
    told = answer(compared(tmp_path / "ours.mcap", tmp_path / "theirs.mcap"))[1]
    assert told == "The same in both, taken for inputs: /shaker.wrench.force.x (1 other channel that stands still)."


def periodic(level: float, *, even: bool = False) -> tuple[TimeSeries, TimeSeries]:
    """A cubic spring behind a gain of 2, and a simulation that forgets the cube."""
    rng, samples = np.random.default_rng(4), 2000
    lines = np.setdiff1d(np.arange(10, 200, 1 if even else 2) + (0 if even else 1), [21, 41, 61, 81, 101, 121])
    spectrum = np.zeros(samples // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    force = np.tile(np.fft.irfft(spectrum, samples), 4)
    force *= level / force.std()
    channels = (Channel(name="/rig/force", unit="N"), Channel(name="/rig/travel", unit="m"))
    noise = 1e-3 * rng.standard_normal(force.size)
    machine, simulation = (
        TimeSeries(values=np.array([force, travel]), sample_rate_hz=500.0, channels=channels)
        for travel in (2 * force + 0.05 * force**3 + noise, 2 * force)
    )
    return machine, simulation


def written(pair: tuple[TimeSeries, TimeSeries], folder: Path) -> tuple[Path, Path]:
    folder.mkdir()
    for series, name in zip(pair, ("ours.mcap", "theirs.mcap"), strict=True):
        write_mcap(series, folder / name, layout="batches")
    return folder / "ours.mcap", folder / "theirs.mcap"


def test_a_periodic_input_splits_both_logs(tmp_path: Path) -> None:
    found = compared(*written(periodic(1.0), tmp_path / "odd"))
    (ours,), (theirs,) = found.distortion, found.simulated_distortion
    # The cube of a Gaussian force is 3 parts of it and some that no linear system gives, of power 6.
    assert ours.odd == pytest.approx(6 * 0.05**2 / (2 + 3 * 0.05) ** 2, rel=0.3)
    assert (theirs.odd < 1e-6, ours.even < 1e-6) == (True, True)
    document: Any = comparison_document(found)
    assert [one["output"] for one in document["distortion"]] == ["/rig/travel.value"]
    assert len(document["simulated_distortion"]) == 1


def test_even_and_odd_together_are_told_where_they_fall_on_the_same_lines(tmp_path: Path) -> None:
    machine, simulation = periodic(1.0, even=True)
    found = compared(*written((machine, simulation), tmp_path / "all"))
    (ours,), (theirs,) = found.distortion, found.simulated_distortion
    assert (ours.even, ours.odd, theirs.even, theirs.odd) == (None, None, None, None)
    force, travel = machine.values
    rest = travel - force * (force @ travel) / (force @ force)
    assert ours.nonlinear == pytest.approx(np.mean(rest**2) / np.mean(travel**2), rel=0.15)
    assert theirs.nonlinear < 1e-6
    headings, rows = split_table(found.distortion, found.simulated_distortion)
    assert (headings[2:], len(rows)) == (("Linear", "Nonlinear", "Noise"), 2)


def test_what_changes_with_level_is_told_of_both(tmp_path: Path) -> None:
    pairs = [written(periodic(level), tmp_path / f"{level}") for level in (2.0, 0.5)]
    found = gap_by_level([compared(*one) for one in pairs])
    gaps = [one.gap for one in found.comparisons]
    assert gaps[0] > 5 * gaps[1]
    assert found.levels[0].startswith(f"the gap is {percent(gaps[1])} (noise")
    assert "at 0.5 RMS of /rig/force" in found.levels[0]
    assert any("what no linear system gives grows" in sentence for sentence in found.levels)
    assert not any("no linear system" in sentence for sentence in found.simulated_levels)
    document: Any = by_level_document(found)
    assert (document["logs"], document["levels"]) == (["ours.mcap"], list(found.levels))
    assert len(document["further"]) == 1
