import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.arm import TOOL, WRIST, short_arm
from tests.make_logs import START_NS, two_sensors, with_strange_topics, write_stored


def tool_samples():
    return next(series.values[0] for series in short_arm().series if series.channels[0].name == TOOL)


def test_the_document_holds_what_was_promised(run, arm_log):
    document = run("psd", arm_log, "--json", "-").document
    assert document["format"] == "chladni.psd/1"
    assert document["averages"] > document["effective_averages"] > 1
    assert len(document["channels"]) == 6
    for channel in document["channels"]:
        assert set(channel) >= {"name", "channel_unit", "psd_unit", "psd", "peaks", "rms"}
        assert len(channel["psd"]) == len(document["frequency_hz"])


def test_level_and_peak_are_those_of_the_signal(run, arm_log):
    document = run("psd", arm_log, "--channel", TOOL, "--resolution", 0.5, "--json", "-").document
    (tool,) = document["channels"]
    assert document["frequency_hz"][1] == 0.5
    assert (tool["channel_unit"], tool["psd_unit"]) == ("m/s^2", "(m/s^2)^2/Hz")
    # The windowed average of a stationary signal; its level scatters by about 1/sqrt(2 B T) of a resonance.
    assert tool["rms"] == pytest.approx(tool_samples().std(), rel=0.03)
    assert tool["peaks"][0]["frequency_hz"] == pytest.approx(short_arm().modes.frequency_hz[-1], rel=0.01)


def test_a_part_of_the_log(run, arm_log):
    document = run("psd", arm_log, "--start", 5, "--end", 15, "--window", "boxcar", "--overlap", 0, "--resolution", 1,
                   "--channel", TOOL, "--json", "-").document  # fmt: skip
    assert document["averages"] == 10
    assert document["window"] == "boxcar"
    segments = tool_samples()[5000:15000].reshape(10, 1000)
    power = np.mean((segments - segments.mean(axis=1, keepdims=True)) ** 2)
    assert document["channels"][0]["rms"] == pytest.approx(np.sqrt(power), rel=1e-9)


def test_of_two_publishers_on_a_topic_each_has_a_spectrum_and_one_can_be_named(run, tmp_path):
    two_sensors(tmp_path / "two.mcap", offset_s=0.003, seconds=40)
    names = ["/s{@channel==1}.data", "/s{@channel==2}.data"]
    both = run("psd", tmp_path / "two.mcap", "--channel", names[0], "--resolution", 0.5, "--json", "-").document
    assert [channel["name"] for channel in both["channels"]] == names[:1]
    assert both["channels"][0]["peaks"][0]["frequency_hz"] == pytest.approx(5.0, abs=0.01)
    second = run("psd", tmp_path / "two.mcap", "--channel", names[1], "--resolution", 0.5, "--json", "-").document
    assert second["channels"][0]["peaks"][0]["frequency_hz"] == pytest.approx(7.0, abs=0.01)
    assert second["channels"][0]["rms"] == pytest.approx(3 / np.sqrt(2), rel=0.01)
    refused = run("psd", tmp_path / "two.mcap", "--channel", "/s.data")
    assert refused.code == 2
    assert f"name one of them: {' or '.join(names)}" in " ".join(refused.err.split())


def test_people_get_levels_peaks_and_what_was_left_out(run, arm_log):
    outcome = run("psd", arm_log, "--channel", TOOL, "--channel", WRIST, "--resolution", 1)
    assert "Levels: " in outcome.out
    assert "Peaks" in outcome.out
    assert TOOL in outcome.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--channel", "/tool.accel.linear.q"], "/tool.accel.linear.q"),
        (["--resolution", "0.001"], "needs segments of 1000 s"),
        (["--resolution", "-1"], "resolution"),
        (["--overlap", "1"], "overlap"),
        (["--window", "hand"], "hand"),
        (["--start", "90"], "between 90.0 s and its end"),
        (["--setup", "not-there.toml"], "not-there.toml"),
    ],
)
def test_bad_options_are_told_in_one_line(run, arm_log, arguments, words):
    outcome = run("psd", arm_log, *arguments)
    assert outcome.code == 2
    assert words in outcome.err
    assert outcome.err.count("\n") == 1


def test_figures_and_report_are_saved_where_asked(run, arm_log, tmp_path):
    report = tmp_path / "r.html"
    outcome = run("psd", arm_log, "--channel", TOOL, "--figures", tmp_path / "figures", "--report", report)
    assert outcome.code == 0, outcome.err
    assert list((tmp_path / "figures").glob("psd*.png"))
    assert TOOL in report.read_text(encoding="utf-8")


def test_a_report_has_pictures_where_plots_arent_wanted(run, arm_log, tmp_path):
    plots, pictures = tmp_path / "plots.html", tmp_path / "pictures.html"
    for report, more in ((plots, []), (pictures, ["--static"])):
        outcome = run("psd", arm_log, "--channel", TOOL, "--report", report, *more)
        assert outcome.code == 0, outcome.err
    assert "<img" in pictures.read_text(encoding="utf-8")
    assert "<script" not in pictures.read_text(encoding="utf-8")
    assert "<script" in plots.read_text(encoding="utf-8")
    refused = run("psd", arm_log, "--static")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "--static says how a report looks; ask for one (--report FILE.html)" in refused.err


def test_a_table_that_is_cut_says_so_and_how_it_is_ordered(run, tmp_path):
    # Twelve tones in noise, in one unit and in two.
    time_s = np.arange(40_000) / 1000
    row = sum(np.sin(2 * np.pi * 35 * number * time_s) for number in range(1, 13))
    noisy = row + 0.1 * np.random.default_rng(1).standard_normal((2, time_s.size))
    units = {"a": ("m/s^2", "m/s^2"), "b": ("m/s^2", "N")}
    for name, pair in units.items():
        channels = tuple(Channel(name=f"/c{number}.value", unit=unit) for number, unit in enumerate(pair))
        write_mcap([TimeSeries(values=noisy, sample_rate_hz=1000.0, channels=channels)], tmp_path / f"{name}.mcap")
    alike = run("psd", tmp_path / "a.mcap", "--window", "hann").out
    assert alike.count("Peaks in m/s^2, the highest first, 10 at most") == 1
    # Heights in different units have no order: each unit has a table of its own.
    mixed = run("psd", tmp_path / "b.mcap", "--window", "hann").out
    assert [f"Peaks in {unit}, the highest first, 10 at most" in mixed for unit in ("m/s^2", "N")] == [True, True]
    # The title is one line, however narrow the table is.
    assert any(line.startswith("Levels: ") and line.rstrip().endswith("Hz apart") for line in alike.splitlines())


def test_a_topic_that_cannot_be_decoded_is_told_and_the_rest_is_averaged(run, tmp_path):
    log = with_strange_topics(tmp_path / "a.mcap")
    outcome = run("psd", log, "--json", "-")
    assert outcome.code == 0
    assert [channel["name"] for channel in outcome.document["channels"]] == ["/good.x"]
    assert "- /bad (100 messages): can't be decoded: " in outcome.err
    # Text holds nothing that could be averaged, and who names a channel knows what is left out.
    assert "/text" not in outcome.err
    assert "/bad" not in run("psd", log, "--channel", "/good.x", "--json", "-").err


@pytest.mark.parametrize(
    ("rate_hz", "tick_ns", "samples"),
    [(104, 10**7, 6240), (1344, 10**6, 4032), (1660, 10**6, 4980), (96, 10**7, 6000)],
)
def test_a_clock_that_ticks_coarsely_makes_no_false_peaks(run, tmp_path, rate_hz, tick_ns, samples):
    number = np.arange(samples)
    when = START_NS + np.floor(number / rate_hz * 1e9 / tick_ns).astype(np.int64) * tick_ns
    tone = np.sin(2 * np.pi * 0.1 * number) + 0.01 * np.random.default_rng(1).standard_normal(samples)
    write_stored(tmp_path / "a.mcap", when, tone)
    (channel,) = run("psd", tmp_path / "a.mcap", "--json", "-").document["channels"]
    assert [peak["frequency_hz"] for peak in channel["peaks"]] == [pytest.approx(0.1 * rate_hz, rel=1e-3)]


@pytest.mark.parametrize("longest", [12, 60, 400])
def test_no_average_crosses_a_restart(run, tmp_path, longest):
    # A tone at a quarter of the rate, by another phase in each episode: averaged across, it would be no line.
    rng = np.random.default_rng(longest)
    lengths = rng.integers(max(8, longest // 8), longest + 1, 60)
    number = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    tone = np.sin(0.5 * np.pi * number + np.repeat(rng.uniform(0, 6, 60), lengths))
    write_stored(tmp_path / "a.mcap", (number + 1) * 10_000_000, tone)
    document = run("psd", tmp_path / "a.mcap", "--json", "-").document
    frequency_hz, psd = np.array(document["frequency_hz"]), np.array(document["channels"][0]["psd"])
    assert 1 / frequency_hz[1] <= lengths.max() / 100
    assert frequency_hz[np.argmax(psd)] == pytest.approx(25.0, abs=0.51 * frequency_hz[1])
    # Hann's main lobe holds all of a tone whose phase doesn't leap.
    outside = np.abs(frequency_hz - 25.0) > 2.5 * frequency_hz[1]
    assert psd[outside].max(initial=0.0) < 1e-3 * psd.max()
