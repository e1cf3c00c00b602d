"""The bench with everything it can do: real models, real logs."""

import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import chladni
from chladni.apps.bench import notebook, open_bench, tools
from chladni.apps.bench_exports import SECONDS, step_seconds
from chladni.apps.measured_log import MOST_SAMPLES, OpenedLog, assign, compare
from chladni.models.core.instrument import Instrument
from chladni.models.core.reading import InstrumentReading
from chladni.models.instruments.pneumatic_motor import INSTRUMENT as MOTOR
from chladni.signals.errors import LogError, ModelError, SetupError
from chladni.viewers.bench.tools import Shown

TOOLS = tools()
DEFAULTS = {option.name: option.default for option in MOTOR.options}


@pytest.fixture(scope="module")
def shown() -> Shown:
    reading = TOOLS.read(MOTOR, MOTOR.parameters.numbers(), DEFAULTS, None)
    return Shown(instrument=MOTOR, model=MOTOR.model(), reading=reading, charts=reading.charts[:2])


@pytest.fixture(scope="module")
def saved(shown: Shown) -> dict[str, bytes]:
    return {export.label: export.build(shown) for export in TOOLS.exports}


@pytest.fixture
def log(saved: dict[str, bytes], tmp_path: Path) -> Any:
    path = tmp_path / "step.mcap"
    path.write_bytes(saved["Log"])
    opened = OpenedLog(path, "step.mcap", private=True)
    yield opened
    opened.close()


def test_a_saved_model_reads_back_bit_for_bit(saved: dict[str, bytes], tmp_path: Path) -> None:
    from chladni.models.files.model_file import load_model

    content = tomllib.loads(saved["Model file"].decode())
    assert content["format"] == "chladni.model/1"
    path = tmp_path / "motor.toml"
    path.write_bytes(saved["Model file"])
    assert load_model(path).parameters.numbers() == MOTOR.model().parameters.numbers()


def test_pictures(saved: dict[str, bytes]) -> None:
    assert saved["PNG"].startswith(b"\x89PNG")
    assert b"<svg" in saved["SVG"][:1000]


def test_a_saved_log_held_against_its_own_model_agrees(log: Any) -> None:
    model = MOTOR.model()
    assignment = assign(model, log.channels)
    assert assignment["flow"] == "/flow.value"
    assert assignment["velocity"] == "/velocity.value"
    found = compare(model, log, assignment, 0.0, 100.0)
    # A step that is there from the first instant excites nothing that an average could see.
    assert "flow is the same all the time in this stretch: there is no transfer function" in found.flags
    # The log holds doubles and times in whole nanoseconds: the rate is known to about 1e-9.
    assert all(one.value is not None and one.value < 1e-4 for one in found.quantities)
    first = [chart.name for chart in found.charts[:3]]
    assert first == ["log.time.displacement", "log.spectrum.displacement", "log.time.velocity"]
    assert [curve.label for curve in found.charts[0].curves] == ["measured", "simulated"]


def test_the_score_is_the_rms_of_the_gap(log: Any) -> None:
    model = MOTOR.model({"active_area": MOTOR.parameters["active_area"].value * 1.2})
    found = compare(model, log, {"flow": "/flow.value", "velocity": "/velocity.value"}, 0.0, 100.0)
    (score,) = found.quantities
    real, made = found.charts[0].curves
    # The curves are thinned, so that this is a check of size: a wrong definition would be off by more.
    expected = 100 * np.sqrt(np.mean((real.y - made.y[: real.y.size]) ** 2)) / np.sqrt(np.mean(real.y**2))
    assert score.value == pytest.approx(expected, rel=0.35)
    assert score.value > 5
    assert any("zero: load" in flag for flag in found.flags)


def test_an_input_beyond_the_log_is_zero_and_a_name_decides_between_two(log: Any) -> None:
    channels = [
        chladni.Channel(name="/valve.flow", unit="m^3/s"),
        chladni.Channel(name="/leak.flow", unit="m^3/s"),
        chladni.Channel(name="/axis.velocity[0]", unit="m/s"),
        chladni.Channel(name="/belt.speed", unit="m/s"),
        chladni.Channel(name="/cell.wrench", unit="N"),
    ]
    found = assign(MOTOR.model(), channels)
    # Two flows are named alike: no guess. One force only: the load.
    assert "flow" not in found
    assert found["velocity"] == "/axis.velocity[0]"
    assert found["load"] == "/cell.wrench"


@pytest.mark.parametrize(
    ("assignment", "line"),
    [
        ({}, "no channel is chosen for any input"),
        ({"flow": "/flow.value"}, "no channel is chosen for any output"),
        ({"flow": "/flow.value", "velocity": "/displacement.value"}, "is in m, velocity in m/s; choose another"),
    ],
)
def test_what_is_chosen_wrongly_is_told(log: Any, assignment: dict[str, str], line: str) -> None:
    with pytest.raises(SetupError, match=line):
        compare(MOTOR.model(), log, assignment, 0.0, 1.0)


def test_a_stretch_outside_the_log_is_told(log: Any) -> None:
    with pytest.raises(LogError) as caught:
        compare(MOTOR.model(), log, {"flow": "/flow.value", "velocity": "/velocity.value"}, 1e6, 1.0)
    assert "\n" not in str(caught.value)


def test_a_data_file_is_held_beside_as_a_log_is(tmp_path: Path) -> None:
    values = np.random.default_rng(1).standard_normal((2, 2000))
    made = made_log(tmp_path, values)
    np.savetxt(tmp_path / "made.csv", values.T, delimiter=",", header="flow,velocity", comments="", fmt="%.17g")
    with pytest.raises(SetupError, match=r"dropped\.csv: .*--rate HZ"):
        OpenedLog(tmp_path / "made.csv", "dropped.csv", private=False)
    reading = {"sample_rate_hz": 1000.0, "units": {"flow": "m^3/s", "velocity": "m/s"}}
    file = OpenedLog(tmp_path / "made.csv", "dropped.csv", private=False, reading=reading)
    assert file.duration_s == pytest.approx(2.0)
    assigned = assign(MOTOR.model(), file.channels)
    assert {name: assigned[name] for name in BOTH} == {"flow": "flow", "velocity": "velocity"}
    chosen = {"flow": "flow", "velocity": "velocity"}
    ours, theirs = (compare(MOTOR.model(), one, names, 0.0, 1.0) for one, names in ((file, chosen), (made, BOTH)))
    assert [one.value for one in ours.quantities] == pytest.approx([one.value for one in theirs.quantities], rel=1e-6)


def test_a_file_without_samples_over_time_says_what_it_holds(tmp_path: Path) -> None:
    from tests.io.files.test_uff_contents import write_functions

    write_functions(tmp_path / "frf.uff")
    with pytest.raises(LogError, match=r"holds 1 frequency response and \d modes, but no samples over time"):
        OpenedLog(tmp_path / "frf.uff", "frf.uff", private=False)


def made_log(
    tmp_path: Path, values: np.ndarray, *, valid: np.ndarray | None = None, rate_hz: float = 1000.0
) -> OpenedLog:
    channels = (
        chladni.Channel(name="/flow.value", unit="m^3/s"),
        chladni.Channel(name="/velocity.value", unit="m/s"),
    )
    series = chladni.TimeSeries(values=values, sample_rate_hz=rate_hz, valid=valid, channels=channels)
    chladni.write_mcap(series, tmp_path / "made.mcap")
    return OpenedLog(tmp_path / "made.mcap", "made.mcap", private=False)


BOTH = {"flow": "/flow.value", "velocity": "/velocity.value"}


def test_a_gap_is_told_and_not_bridged(tmp_path: Path) -> None:
    valid = np.ones((2, 2000), dtype=bool)
    valid[:, 700:900] = False
    log = made_log(tmp_path, np.random.default_rng(1).standard_normal((2, 2000)), valid=valid)
    with pytest.raises(SetupError, match=r"made\.mcap: samples are missing between these times"):
        compare(MOTOR.model(), log, BOTH, 0.0, 2.0)
    compare(MOTOR.model(), log, BOTH, 1.0, 1.0)
    log.close()


def test_too_long_a_stretch_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chladni.apps.measured_log.MOST_SAMPLES", 1000)
    log = made_log(tmp_path, np.random.default_rng(1).standard_normal((2, 2000)))
    with pytest.raises(SetupError, match="2 s are too long to compare; take at most 1 s"):
        compare(MOTOR.model(), log, BOTH, 0.0, 2.0)
    log.close()
    assert MOST_SAMPLES == 500_000


def test_too_short_a_stretch_has_no_spectrum_and_says_so(tmp_path: Path) -> None:
    log = made_log(tmp_path, np.random.default_rng(1).standard_normal((2, 2000)))
    found = compare(MOTOR.model(), log, BOTH, 0.0, 0.004)
    assert [chart.name for chart in found.charts] == ["log.time.velocity"]
    assert "4 samples are too few for a spectrum; take a longer stretch." in found.flags
    log.close()


def test_spectra_and_transfer_functions_stand_beside_the_time(tmp_path: Path) -> None:
    """A log made of the model's own answer to noise: measured and simulated are one curve in every chart."""
    from chladni.models.integrator.simulate import simulate

    model = MOTOR.model()
    noise = np.random.default_rng(2).standard_normal((1, 4000)) * 1e-5
    flow = chladni.TimeSeries(
        values=noise, sample_rate_hz=1000.0, channels=(chladni.Channel(name="flow", unit="m^3/s"),)
    )
    answer = simulate(model, flow).outputs
    row = [channel.name for channel in answer.channels].index("velocity")
    log = made_log(tmp_path, np.stack([noise[0], answer.values[row]]))
    found = compare(model, log, BOTH, 0.0, 4.0)
    assert [chart.name.split(".")[1] for chart in found.charts] == ["time", "spectrum", "transfer"]
    assert found.charts[1].y_label == "PSD [(m/s)^2/Hz]"
    for chart in found.charts:
        measured, simulated = chart.curves
        assert measured.x.size > 100
        # The log keeps every double; only its clock, in whole nanoseconds, differs.
        np.testing.assert_allclose(measured.y, simulated.y, rtol=1e-4, atol=1e-6 * np.nanmax(np.abs(measured.y)))
    log.close()


def test_nothing_measured_has_no_score(tmp_path: Path) -> None:
    values = np.zeros((2, 2000))
    values[0] = np.random.default_rng(1).standard_normal(2000)
    log = made_log(tmp_path, values)
    assert compare(MOTOR.model(), log, BOTH, 0.0, 2.0).quantities[0].value is None
    log.close()


def test_only_an_opened_log_is_compared() -> None:
    with pytest.raises(TypeError, match="int is no OpenedLog"):
        compare(MOTOR.model(), 3, BOTH, 0.0, 1.0)  # type: ignore[arg-type]


def test_what_is_no_log_is_told(tmp_path: Path) -> None:
    path = tmp_path / "text.mcap"
    path.write_text("no log")
    with pytest.raises(LogError):
        open_bench([MOTOR], log=path)
    with pytest.raises(LogError):
        TOOLS.open_log(tmp_path / "missing.mcap", "missing.mcap", True)


@pytest.mark.parametrize("size", [20, 300, 20_000])
def test_a_log_that_was_cut_off_before_its_first_channel_says_what_is_missing(
    saved: dict[str, bytes], tmp_path: Path, size: int
) -> None:
    path = tmp_path / "chladni-x1y2.mcap"
    path.write_bytes(saved["Log"][:size])
    with pytest.raises(LogError, match=r"^press\.mcap: holds no channel that can be read; ") as caught:
        TOOLS.open_log(path, "press.mcap", True)
    assert "its recording was cut off" in str(caught.value)
    assert "an unknown number of messages lost" in str(caught.value)
    # The private copy is of no use to anybody.
    assert not path.exists()


def test_a_log_that_was_cut_off_later_says_what_is_missing_and_is_read(
    saved: dict[str, bytes], tmp_path: Path
) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(saved["Log"][: len(saved["Log"]) // 2])
    opened = TOOLS.open_log(path, "cut.mcap", False)
    assert len(opened.channels) == 6
    assert any("its recording was cut off" in sentence for sentence in opened.damage)
    opened.close()


def test_a_whole_log_has_no_damage(log: Any) -> None:
    assert log.damage == ()


def test_a_dropped_log_is_called_by_its_own_name(tmp_path: Path) -> None:
    path = tmp_path / "chladni-x1y2.mcap"
    path.write_bytes(b"")
    with pytest.raises(LogError, match=r"^press\.mcap: the file is empty") as caught:
        TOOLS.open_log(path, "press.mcap", True)
    assert "chladni-x1y2" not in str(caught.value)


def test_a_private_copy_is_removed_when_the_program_ends(saved: dict[str, bytes], tmp_path: Path) -> None:
    path = tmp_path / "copy.mcap"
    path.write_bytes(saved["Log"])
    code = (
        "import sys; from pathlib import Path; from chladni.apps.measured_log import OpenedLog;"
        "log = OpenedLog(Path(sys.argv[1]), 'copy', private=True); print(log.duration_s > 0)"
    )
    run = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert run.stdout == "True\n"
    assert not path.exists()


def test_rows_of_variants(tmp_path: Path) -> None:
    path = tmp_path / "areas.csv"
    path.write_text("name,active_area [cm^2]\nsmall,60\nlarge,80\n")
    look = TOOLS.watch(MOTOR, path)
    rows = look()
    assert [one.label for one in rows.variants] == ["small", "large"]
    assert rows.variants[1].values["active_area"] == pytest.approx(80e-4)
    assert set(rows.variants[0].values) == set(MOTOR.parameters)
    assert rows.variants[0].options == DEFAULTS
    path.write_text("name,acitve_area [cm^2]\nsmall,60\n")
    look()
    wrong = look()
    assert wrong.variants == rows.variants
    assert "acitve_area" in wrong.mistake


def test_influence() -> None:
    table = TOOLS.influence(MOTOR, MOTOR.parameters.numbers(), DEFAULTS)
    assert "active_area" in table.construction


def test_an_instrument_without_an_input_to_step_has_no_log(shown: Shown) -> None:
    silent = Instrument(
        name="still", title="Still", parameters=MOTOR.parameters, build=lambda *_: MOTOR.model(), step_input=""
    )
    with pytest.raises(ModelError, match="still has no input to step"):
        TOOLS.exports[-1].build(
            Shown(instrument=silent, model=shown.model, reading=shown.reading, charts=shown.charts)
        )


def test_a_reading_without_a_step_has_a_length_all_the_same() -> None:
    assert step_seconds(InstrumentReading(charts=(), quantities=(), flags=())) == SECONDS


def test_a_page_in_a_notebook(tmp_path: Path) -> None:
    import panel as pn

    shown = notebook(MOTOR)
    assert isinstance(shown, pn.viewable.Viewable)
    figures = [model for model in shown.get_root().references() if type(model).__name__ == "figure"]
    assert len(figures) == 6
