"""Every command takes every file: the same answer as for a log made of it, and advice that can be followed."""

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat, wavfile
from scipy.signal import lfilter

from chladni.cli.main import main
from chladni.io.convert import convert
from chladni.io.files.csv import write_csv
from chladni.io.files.uff import write_uff
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests import made_diagnosis as made
from tests.cli.conftest import Run
from tests.gap_stand_in import put_in_place

RATE_HZ, SAMPLES = 500.0, 20_000
#: Poles of the tip's motion: 60 Hz, 2 % damping.
NATURAL_HZ, DAMPING = 60.0, 0.02
CHANNELS = (Channel(name="force", unit="N"), Channel(name="tip", unit="m/s^2"))


def measured(gain: float = 1.0) -> TimeSeries:
    """Noise as a force, and what a sampled resonator of known poles makes of it."""
    force = np.random.default_rng(17).standard_normal(SAMPLES)
    pole = np.exp((-DAMPING + 1j * np.sqrt(1 - DAMPING**2)) * 2 * np.pi * NATURAL_HZ / RATE_HZ)
    tip = lfilter([1.0, -2.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)
    # Single precision, which every kind of file holds.
    values = np.stack([force, gain * tip]).astype(np.float32).astype(np.float64)
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=CHANNELS)


def _wav(series: TimeSeries, path: Path) -> None:
    wavfile.write(path, int(RATE_HZ), series.values.T.astype(np.float32))


def _mat(series: TimeSeries, path: Path) -> None:
    savemat(path, {"fs": RATE_HZ, "force": series.values[0], "tip": series.values[1]})


def _npz(series: TimeSeries, path: Path) -> None:
    np.savez(path, t=series.times_s(), force=series.values[0], tip=series.values[1])


def _bare(series: TimeSeries, path: Path) -> None:
    np.savetxt(path, series.values.T, delimiter=",", header="force,tip", comments="")


#: Commands that measure each channel by itself.
SPECTRA = ("levels", "psd", "octaves", "envelope", "cepstrum")
UNITS = ("--read", "units=force:N,tip:m/s^2")
KINDS: dict[str, tuple[Callable[[TimeSeries, Path], object], tuple[object, ...]]] = {
    "table.csv": (write_csv, ()),
    "bare.csv": (_bare, ("--rate", RATE_HZ, *UNITS)),
    "sound.wav": (_wav, ("--read", "names=force,tip", *UNITS)),
    "arrays.mat": (_mat, UNITS),
    "arrays.npz": (_npz, UNITS),
    "records.uff": (write_uff, ()),
}


@pytest.fixture(scope="module", params=list(KINDS))
def file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tuple[object, ...]]:
    """A data file, and the options that it takes; the log made of it lies beside it."""
    make, options = KINDS[request.param]
    path = tmp_path_factory.mktemp("doors") / request.param
    make(measured(), path)
    return path, options


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as an MCAP log."""
    path = tmp_path_factory.mktemp("log") / "same.mcap"
    write_mcap([measured()], path, layout="batches")
    return path


@pytest.fixture(scope="module")
def of_the_log(log: Path) -> Callable[..., Any]:
    """What a command answers to the log, which all files are held against; asked once."""

    @cache
    def answer(*command: object) -> Any:
        answered = log.with_suffix(".json")
        assert main([str(part) for part in (command[0], log, *command[1:], "--json", answered)]) == 0
        return plain(json.loads(answered.read_text()))

    return answer


def plain(document: Any) -> Any:
    """Without the topic that a log's channels have, and what only a file's clock can tell."""
    return json.loads(json.dumps(document).replace("/daq.", ""))


COMMANDS: tuple[tuple[str, tuple[object, ...]], ...] = (
    ("psd", ()),
    ("psd", ("--channel", "tip", "--start", 4, "--end", 20, "--resolution", 1)),
    ("levels", ()),
    ("levels", ("--channel", "tip", "--start", 4, "--band", 20, 100)),
    ("octaves", ("--channel", "tip")),
    ("envelope", ("--channel", "tip", "--band", 40, 80)),
    ("cepstrum", ("--channel", "tip")),
    ("frf", ()),
    ("frf", ("--reference", "force", "--response", "tip")),
    ("modes", ("--band", 40, 80)),
    ("modes", ("--operational", "--channel", "tip")),
    ("srs", ("--q", 25)),
)


# In the gate each file goes through a third of the commands, and each command takes two of the files.
@pytest.mark.parametrize(
    ("file", "command", "options"),
    [
        pytest.param(kind, *asked, marks=() if (place - number) % 3 == 0 else pytest.mark.nightly)
        for number, kind in enumerate(KINDS)
        for place, asked in enumerate(COMMANDS)
    ],
    indirect=["file"],
)
def test_the_answer_is_that_of_a_log_made_of_it(
    run: Run,
    file: tuple[Path, tuple[object, ...]],
    of_the_log: Callable[..., Any],
    command: str,
    options: tuple[object, ...],
) -> None:
    path, reading = file
    ours = run(command, path, *reading, *options, "--json", "-")
    assert ours.code == 0, ours.err
    expected = of_the_log(command, *(f"/daq.{one}" if one in ("force", "tip") else one for one in options))
    found = ours.document
    assert found.keys() == expected.keys()
    for key in ("channels", "functions", "modes"):
        for one, other in zip(found.get(key, ()), expected.get(key, ()), strict=True):
            numbers = one["bands"][0] if command == "levels" else one
            for name, value in (other["bands"][0] if command == "levels" else other).items():
                if isinstance(value, float):
                    assert numbers[name] == pytest.approx(value, rel=1e-5, abs=1e-6), name
    if command == "modes":
        (mode,) = found["modes"]
        assert mode["frequency_hz"] == pytest.approx(NATURAL_HZ, rel=5e-3)
        assert mode["damping_ratio"] == pytest.approx(DAMPING, rel=0.25)


def test_info_tells_kind_clock_and_samples(run: Run, file: tuple[Path, tuple[object, ...]]) -> None:
    path, reading = file
    outcome = run("info", path, *reading, "--json", "-")
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["duration_s"]) == ("chladni.info/1", pytest.approx(SAMPLES / RATE_HZ))
    for channel, known in zip(document["channels"], CHANNELS, strict=True):
        assert (channel["name"], channel["unit"], channel["samples"]) == (known.name, known.unit, SAMPLES)
        assert channel["encoding"] == path.suffix[1:]
        assert channel["stamp"] == ("column" if path.name in ("table.csv", "arrays.npz") else "rate")
        assert channel["rate_hz"] == pytest.approx(RATE_HZ, rel=1e-6)


@pytest.mark.nightly
@pytest.mark.parametrize(
    "file",
    [kind if kind == "table.csv" else pytest.param(kind, marks=pytest.mark.nightly) for kind in KINDS],
    indirect=True,
)
def test_view_draws_it(run: Run, file: tuple[Path, tuple[object, ...]], tmp_path: Path) -> None:
    path, reading = file
    outcome = run("view", path, *reading, "--save", tmp_path / "a.rrd", "--figures", tmp_path, "--json", "-")
    assert outcome.code == 0, outcome.err
    assert (tmp_path / "a.rrd").stat().st_size > 1000
    assert list(tmp_path.glob("*.png"))
    assert any("Highest peaks over force" in finding for finding in outcome.document["findings"])


def test_a_file_is_compared_with_a_log(run: Run, file: tuple[Path, tuple[object, ...]], tmp_path: Path) -> None:
    path, reading = file
    write_csv(measured(gain=2.0), tmp_path / "after.csv")
    if "--read" in reading or "--rate" in reading:
        # Options hold for both files, so both are of one kind.
        make, _ = KINDS[path.name]
        make(measured(gain=2.0), tmp_path / path.name)
        after = tmp_path / path.name
    else:
        after = tmp_path / "after.csv"
    outcome = run("compare", path, after, *reading, "--json", "-")
    assert outcome.code == 0, outcome.err
    changes = {one["channel"]: one["change_db"] for one in outcome.document["levels"]}
    assert changes["tip"] == pytest.approx(20 * np.log10(2), abs=0.01)
    assert changes["force"] == pytest.approx(0, abs=1e-6)


def test_options_for_one_kind_are_no_matter_for_the_other(run: Run, log: Path, tmp_path: Path) -> None:
    series = measured(gain=2.0)
    table = np.column_stack([1000 * series.times_s(), series.values.T])
    header = "stamp,/daq.force [N],/daq.tip [m/s^2]"
    np.savetxt(tmp_path / "after.csv", table, delimiter=",", header=header, comments="")
    options = ("--time-unit", "ms", "--stamp", "log", "--json", "-")
    outcome = run("compare", log, tmp_path / "after.csv", *options)
    assert outcome.code == 0, outcome.err
    changes = {one["channel"]: one["change_db"] for one in outcome.document["levels"]}
    assert changes["/daq.tip"] == pytest.approx(20 * np.log10(2), abs=0.01)
    for alone in (log, tmp_path / "after.csv"):
        assert run("compare", alone, alone, *options).code == 2


def test_simulated_and_measured_files_are_held_against_each_other(
    run: Run, file: tuple[Path, tuple[object, ...]], tmp_path: Path
) -> None:
    path, reading = file
    make, _ = KINDS[path.name]
    make(measured(gain=1.1), tmp_path / path.name)
    outcome = run("gap", path, "--simulated", tmp_path / path.name, *reading, "--json", "-")
    assert outcome.code == 0, outcome.err
    assert outcome.document["inputs"] == ["force"]
    assert outcome.document["gap"]["before"] == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize("kind", ["csv", "uff", "mat", "npz"])
def test_a_diagnosis_reads_data_files(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str) -> None:
    engine = put_in_place(monkeypatch, made.diagnosis())
    model = made.write_arm_model(tmp_path)
    write_mcap(made.log_series(), tmp_path / "arm.mcap")
    convert(tmp_path / "arm.mcap", tmp_path / f"arm.{kind}")
    assert run("gap", model, tmp_path / "arm.mcap").code == 0
    (expected,) = engine.measurements
    outcome = run("gap", model, tmp_path / f"arm.{kind}")
    assert outcome.code == 0, outcome.err
    (found,) = engine.measurements
    np.testing.assert_array_equal(found.inputs, expected.inputs)
    np.testing.assert_array_equal(found.outputs, expected.outputs)
    assert found.output_units == expected.output_units
    refused = run("gap", tmp_path / f"arm.{kind}", model)
    assert refused.code == 2
    assert f"arm.{kind}: is a log; give a model file first" in refused.err


def test_a_model_is_driven_by_a_data_file(run: Run, tmp_path: Path) -> None:
    model = made.write_arm_model(tmp_path)
    series = made.log_series()
    header = ",".join(f"{channel.name} [{channel.unit}]" for channel in series.channels)
    np.savetxt(tmp_path / "bare.csv", series.values.T, delimiter=",", header=header, comments="", fmt="%.17g")
    refused = run("simulate", model, "--log", tmp_path / "bare.csv", "--out", tmp_path / "out.mcap")
    assert refused.code == 2
    assert "--rate HZ" in refused.err
    options = ("--log", tmp_path / "bare.csv", "--rate", made.RATE_HZ, "--out", tmp_path / "out.mcap", "--json", "-")
    outcome = run("simulate", model, *options)
    assert outcome.code == 0, outcome.err
    assert outcome.document["sample_rate_hz"] == pytest.approx(made.RATE_HZ)


# --- advice ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [
        *("info", "psd", "frf", "view", "compare", "gap", "convert"),
        *(
            pytest.param(one, marks=pytest.mark.nightly)
            for one in ("levels", "octaves", "envelope", "cepstrum", "modes", "srs")
        ),
    ],
)
def test_a_rate_that_is_asked_for_can_be_given(run: Run, tmp_path: Path, command: str) -> None:
    _bare(measured(), tmp_path / "bare.csv")
    beside: dict[str, tuple[object, ...]] = {
        "view": ("--save", tmp_path / "a.rrd"),
        "compare": (tmp_path / "bare.csv",),
        "convert": (tmp_path / "a.mcap",),
        "gap": ("--simulated", tmp_path / "bare.csv"),
    }
    arguments = (command, tmp_path / "bare.csv", *beside.get(command, ()))
    refused = run(*arguments)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "--rate HZ" in refused.err
    told = run(*arguments, "--rate", RATE_HZ, *UNITS)
    # Two equal files have no gap between them, which is told and is no matter of the rate.
    assert told.code == (2 if command == "gap" else 0), told.err
    assert "rate" not in told.err


@pytest.mark.parametrize(
    "command",
    [
        *("info", "psd", "modes", "srs", "view"),
        # Which options each of them takes, the test above tells.
        *(
            pytest.param(one, marks=pytest.mark.nightly)
            for one in ("levels", "octaves", "envelope", "cepstrum", "frf")
        ),
    ],
)
def test_a_time_unit_that_is_asked_for_can_be_given(run: Run, tmp_path: Path, command: str) -> None:
    series = measured()
    table = np.column_stack([1000 * series.times_s(), series.values.T])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="stamp,force [N],tip [m/s^2]", comments="")
    beside = ("--save", tmp_path / "a.rrd") if command == "view" else ()
    refused = run(command, tmp_path / "a.csv", *beside)
    if refused.code == 2:
        assert re.search(r"time.unit", refused.err)
    told = run(command, tmp_path / "a.csv", "--time-unit", "ms", *beside, "--json", "-")
    assert told.code == 0, told.err
    if command == "info":
        assert told.document["channels"][0]["rate_hz"] == pytest.approx(RATE_HZ)


def test_a_missing_excitation_can_be_named_or_set_up(run: Run, tmp_path: Path) -> None:
    series = measured().with_channels((Channel(name="a", unit="V"), Channel(name="b", unit="V")))
    write_csv(series, tmp_path / "a.csv")
    refused = run("frf", tmp_path / "a.csv")
    assert refused.code == 2
    assert (
        "a.csv: no channel that changes is known as an excitation; name it as reference (--reference)" in refused.err
    )
    assert run("frf", tmp_path / "a.csv", "--reference", "a").code == 0
    (tmp_path / "setup.toml").write_text(
        'format = "chladni.setup/1"\n[[channel]]\npath = "a"\nrole = "reference"\nsensitivity = "10 mV/N"\n'
    )
    outcome = run("frf", tmp_path / "a.csv", "--setup", tmp_path / "setup.toml", "--json", "-")
    assert outcome.code == 0, outcome.err
    assert outcome.document["functions"][0]["unit"] == "V/N"


def test_what_is_not_read_is_told_by_every_command(run: Run, tmp_path: Path) -> None:
    from tests.io.files.test_uff import text_set

    write_uff(measured(), tmp_path / "records.uff")
    path = tmp_path / "a.uff"
    path.write_bytes((tmp_path / "records.uff").read_bytes() + text_set(kind=9).encode())
    for command in (*SPECTRA, "info", "frf", "modes", "srs"):
        outcome = run(command, path)
        assert outcome.code == 0, outcome.err
        assert "power spectral density (1): not read" in " ".join(outcome.out.split())


# --- functions that a file holds ready-made ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def functions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The transfer function of the measured file, as another program would export it."""
    import chladni
    from chladni.io.files.uff_modes import write_uff_modes

    frf = chladni.frf(measured(), references="force")
    modes = chladni.identify_modes(frf, band_hz=(40, 80))
    path = tmp_path_factory.mktemp("functions") / "frf.uff"
    write_uff_modes(path, modes, geometry=chladni.load_setup(_setup(path.parent)).geometry, response=frf)
    return path


def _setup(folder: Path) -> Path:
    (folder / "setup.toml").write_text('format = "chladni.setup/1"\n[[point]]\nname = "tip"\nposition = [0, 0, 1]\n')
    return folder / "setup.toml"


def test_functions_are_shown_by_the_commands_for_them(run: Run, functions: Path, tmp_path: Path) -> None:
    assert run("info", functions, "--json", "-").document["functions"][0]["response"] == "tip"
    frf = run("frf", functions, "--json", "-", "--figures", tmp_path)
    assert frf.code == 0, frf.err
    (peak,) = frf.document["functions"][0]["peaks"]
    assert peak["frequency_hz"] == pytest.approx(NATURAL_HZ, rel=0.02)
    assert list(tmp_path.glob("*.png"))
    assert run("modes", functions, "--band", 40, 80, "--json", "-").document["modes"][0][
        "frequency_hz"
    ] == pytest.approx(NATURAL_HZ, rel=5e-3)
    view = run("view", functions, "--save", tmp_path / "a.rrd")
    assert view.code == 0, view.err
    assert "Highest peaks over force" in " ".join(view.out.split())


def test_functions_are_compared(run: Run, functions: Path) -> None:
    outcome = run("compare", functions, functions, "--modes", "--json", "-")
    assert outcome.code == 0, outcome.err
    assert outcome.document["levels"] == []
    assert {one["fate"] for one in outcome.document["response_peaks"]} == {"unchanged"}


@pytest.mark.parametrize("command", [*SPECTRA, "srs", "gap", "convert", "modes"])
def test_commands_for_samples_say_what_the_file_holds(
    run: Run, functions: Path, tmp_path: Path, command: str
) -> None:
    beside: dict[str, tuple[object, ...]] = {
        "convert": (tmp_path / "a.mcap",),
        "gap": ("--simulated", functions),
        "modes": ("--operational",),
    }
    refused = run(command, functions, *beside.get(command, ()))
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "1 frequency response and 1 mode, but no samples over time; chladni frf frf.uff" in refused.err
