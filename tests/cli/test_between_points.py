"""``chladni ods`` and ``chladni delay`` on a tone and noise that arrive late."""

import numpy as np
import pytest

import chladni
from chladni.apps.delay import log_delays
from chladni.apps.orders import track_orders
from chladni.apps.sources import Span
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ, SAMPLES, LATE = 500.0, 20_000, 7
BASE, ARM, FORCE = "/base.x", "/arm.x", "/cell.f"


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """Noise and a tone of 40 Hz at the base, seven samples later and opposite at the arm."""
    rng = np.random.default_rng(1)
    t = np.arange(SAMPLES + LATE) / RATE_HZ
    whole = rng.standard_normal(t.size) + 4 * np.cos(2 * np.pi * 40 * t)
    arm = -0.5 * whole[:SAMPLES] + 0.05 * rng.standard_normal(SAMPLES)
    rows = ((BASE, "m/s^2", whole[LATE:]), (ARM, "m/s^2", arm), (FORCE, "N", rng.standard_normal(SAMPLES)))
    path = tmp_path_factory.mktemp("walk") / "walk.mcap"
    write_mcap(
        [
            TimeSeries(
                values=np.stack([values for _, _, values in rows]),
                sample_rate_hz=RATE_HZ,
                channels=tuple(Channel(name=name, unit=unit) for name, unit, _ in rows),
            )
        ],
        path,
        layout="batches",
    )
    return path


def test_a_shape_is_that_of_the_tone(run, walk, tmp_path):
    options = ("--reference", BASE, "--resolution", 1, "--json", "-", "--figures", tmp_path)
    outcome = run("ods", walk, *options)
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["reference"]) == ("chladni.ods/1", BASE)
    (shape,) = document["shapes"]
    assert shape["frequency_hz"] == 40.0
    parts = {part["channel"]: part for part in shape["shape"]}
    assert parts[BASE]["phase_deg"] == 0
    assert parts[BASE]["rms"] == pytest.approx(4 / np.sqrt(2), rel=0.02)
    assert parts[ARM]["rms"] == pytest.approx(2 / np.sqrt(2), rel=0.02)
    # Seven samples of 2 ms are 201.6 degrees of 40 Hz, and the sign turns.
    assert parts[ARM]["phase_deg"] == pytest.approx(180 - 201.6, abs=1)
    assert {path.name for path in tmp_path.glob("*.png")} == {"ods-acceleration.png", "ods-force.png"}


def test_a_delay_is_found_with_its_sign(run, walk, tmp_path):
    options = ("--reference", BASE, "--longest", 0.1, "--json", "-", "--figures", tmp_path)
    outcome = run("delay", walk, *options)
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert document["format"] == "chladni.delay/1"
    (found,) = document["delays"]
    assert (found["response"], found["inverted"]) == (ARM, True)
    assert abs(found["delay_s"] - LATE / RATE_HZ) < 4 * found["std_s"] < 1e-4
    assert "opposite" in run("delay", walk, "--reference", BASE, "--response", ARM, "--longest", 0.1).out
    assert (tmp_path / "correlation.png").exists()


@pytest.mark.parametrize(
    ("command", "options", "words"),
    [
        ("ods", ("--reference", "/bse.x"), "/bse.x"),
        ("ods", ("--reference", BASE, "--frequency", 300), "walk.mcap: 300 Hz lies outside the spectrum"),
        ("delay", ("--reference", BASE, "--band", 300, 100), "--band: a band from 300 to 100 Hz"),
        ("delay", ("--reference", FORCE), "walk.mcap: nothing that changes is in N as /cell.f is"),
        ("delay", ("--reference", BASE, "--response", FORCE), "isn't coherent with /base.x"),
    ],
)
def test_bad_options_are_told_in_one_line(run, walk, command, options, words):
    refused = run(command, walk, *options)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert words in refused.err


@pytest.mark.parametrize(
    ("command", "listed", "numbers"),
    [("srs", "channels", "maximax"), ("zoom --band 35-45 --lines 50", "channels", "amplitude")],
)
def test_a_large_log_is_read_in_blocks(run, walk, monkeypatch, command, listed, numbers):
    asked = (*command.split()[:1], walk, *command.split()[1:], "--channel", BASE, "--channel", ARM, "--json", "-")
    whole = run(*asked).document[listed]
    monkeypatch.setattr("chladni.io.source.IN_MEMORY_BYTES", 0)
    monkeypatch.setattr("chladni.io.source.VALUES_IN_A_BLOCK", 3000)
    parts = run(*asked).document[listed]
    assert [one["name"] for one in parts] == [one["name"] for one in whole] == [BASE, ARM]
    for one, other in zip(parts, whole, strict=True):
        np.testing.assert_allclose(one[numbers], other[numbers], rtol=1e-9)


@pytest.fixture(scope="module")
def run_up(tmp_path_factory):
    """A shaft from 10 to 20 Hz whose second order three sensors feel, each later than the one before; one is dead."""
    t = np.arange(20_000) / RATE_HZ
    turned = 10 * t + 0.125 * t**2
    rng = np.random.default_rng(2)
    noise = rng.standard_normal(t.size + 10)
    rows = [np.mod(turned, 1) < 0.3, np.full(t.size, 0.1)]
    rows += [noise[late : late + t.size] + np.cos(4 * np.pi * turned) for late in (10, 5, 0)]
    values = np.stack([np.asarray(row, dtype=np.float64) for row in rows])
    # A gap in one sensor is none in the others.
    values[4, 5000:5100] = np.nan
    names = ("/rig.pulse", "/rig.dead", "/rig.a", "/rig.b", "/rig.c")
    channels = tuple(Channel(name=name, unit="V" if name == "/rig.pulse" else "m/s^2") for name in names)
    path = tmp_path_factory.mktemp("run_up") / "run_up.mcap"
    series = TimeSeries(values=values, valid=np.isfinite(values), sample_rate_hz=RATE_HZ, channels=channels)
    write_mcap([series], path)
    return path


def found_of(path):
    """Give all arrays of the delays and of the orders of a log."""
    with chladni.open(path) as log:
        delays = log_delays(
            log, reference="/rig.a", responses=None, band_hz=(60.0, 200.0), longest_delay_s=0.5, resolution_hz=None,
            span=Span(),
        )  # fmt: skip
        orders = track_orders(
            log, shaft="/rig.pulse", channels=None, orders=None, method="angle", revolutions=None, highest_order=5.0,
            span=Span(), telling="tacho",
        )  # fmt: skip
    (chart,), (cuts,) = orders.maps, orders.cuts
    assert [one.name for one in delays.responses] == ["/rig.b", "/rig.c"]
    assert (
        [one.name for one in chart.channels] == [one.name for one in cuts.channels] == ["/rig.a", "/rig.b", "/rig.c"]
    )
    return delays.delay_s, delays.std_s, delays.coherence, delays.correlation.values, chart.values, cuts.values


def test_channels_one_at_a_time_tell_what_all_together_do(run_up, monkeypatch):
    whole = found_of(run_up)
    np.testing.assert_allclose(whole[0], [5 / RATE_HZ, 10 / RATE_HZ], atol=2e-5)
    monkeypatch.setattr("chladni.apps.sources.VALUES_TOGETHER", 1)
    monkeypatch.setattr("chladni.spectral.orders.BATCH_SAMPLES", 1000)
    for one, other in zip(found_of(run_up), whole, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.nanmax(np.abs(other)))


@pytest.mark.parametrize(
    ("command", "count", "values", "share_s"),
    [
        (f"delay --reference {BASE}", "2 channels", "4e+04", 12),
        (f"delay --reference {BASE} --response {ARM}", "2 channels", "4e+04", 12),
        (f"orders --ridge {BASE} --channel {ARM}", "1 channel", "2e+04", 24),
    ],
)
def test_what_needs_a_whole_record_names_the_part_that_fits(run, walk, monkeypatch, command, count, values, share_s):
    monkeypatch.setattr("chladni.apps.sources.MOST_VALUES", 12_000)
    first, *rest = command.split()
    refused = run(first, walk, *rest)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert f"takes all samples of {count} at once, and {values} are more than the 12000 that fit" in refused.err
    assert f"a part of {share_s} s or less (--start, --end)" in refused.err
    advised = run(first, walk, *rest, "--end", share_s)
    assert advised.code == 0, advised.err
