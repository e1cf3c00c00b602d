import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ, SECONDS = 400.0, 40.0
VIBRATION, TACHO, SPEED = "/imu.x", "/tacho.volts", "/motor.speed"


@pytest.fixture(scope="module")
def run_up(tmp_path_factory):
    """Orders 1 and 3, of 2 and 0.5 m/s^2, from 10 to 30 revolutions a second; two pulses a revolution."""
    t = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ
    turned = 10 * t + 10 * t**2 / SECONDS
    vibration = 2 * np.cos(2 * np.pi * turned) + 0.5 * np.sin(2 * np.pi * 3 * turned)
    vibration += 0.01 * np.random.default_rng(1).standard_normal(t.size)
    rows = (
        (VIBRATION, "m/s^2", vibration),
        (TACHO, "V", np.cos(2 * np.pi * 2 * turned)),
        (SPEED, "rad/s", 2 * np.pi * (10 + 20 * t / SECONDS)),
    )
    path = tmp_path_factory.mktemp("run-up") / "run.mcap"
    series = [
        TimeSeries(values=values[None], sample_rate_hz=RATE_HZ, channels=(Channel(name=name, unit=unit),))
        for name, unit, values in rows
    ]
    write_mcap(series, path, layout="batches")
    return path


@pytest.mark.parametrize("telling", [("--tacho", TACHO, "--pulses", 2), ("--speed", SPEED)])
@pytest.mark.parametrize("method", ["angle", "vold-kalman"])
def test_orders_are_found_and_followed(run, run_up, telling, method):
    outcome = run("orders", run_up, *telling, "--method", method, "--json", "-")
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["rotation"], document["orders"]) == (
        "chladni.orders/1",
        telling[0][2:],
        [1.0, 3.0],
    )
    (grid,) = document["grids"]
    (channel,) = grid["channels"]
    assert (channel["name"], channel["unit"]) == (VIBRATION, "m/s^2")
    assert grid["speed_hz"][-1] == pytest.approx(30, abs=0.5)
    for cut, size in zip(channel["cuts"], (2.0, 0.5), strict=True):
        np.testing.assert_allclose(cut["amplitude"], size, rtol=0.03)
        assert len(cut["phase_deg"]) == len(grid["time_s"])


def test_people_get_a_table_and_pictures(run, run_up, tmp_path):
    outcome = run("orders", run_up, "--ridge", VIBRATION, "--ridge-band", 8, 32, "--order", 3, "--figures", tmp_path)
    assert outcome.code == 0, outcome.err
    assert "where each is highest" in outcome.out
    names = {path.name.split("-imu")[0] for path in tmp_path.glob("*.png")}
    assert names == {"order-map", "order-cuts", "campbell"}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "name exactly one channel that tells the shaft's rotation: --tacho, --phase, --speed, --ridge"),
        (("--tacho", TACHO, "--speed", SPEED), "name exactly one channel"),
        (("--phase", TACHO), "run.mcap: /tacho.volts is in V; an angle must be in rad"),
        (("--tacho", TACHO, "--threshold", 3), "pulses through 3; four are needed"),
        (("--speed", "/motor.sped"), "/motor.sped"),
        (("--speed", SPEED, "--order", -1), "orders -1: give different ones above 0"),
        (("--speed", SPEED, "--revolutions", 1e5), "the shaft turns 800 times without a break"),
    ],
)
def test_bad_options_are_told_in_one_line(run, run_up, options, words):
    refused = run("orders", run_up, *options)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert words in refused.err


def test_a_channel_that_never_changes_has_no_orders_and_tells_no_rotation(run, tmp_path):
    time_s = np.arange(8000) / 1000
    pulses = (np.mod(10 * time_s, 1) < 0.1).astype(float)
    rows = "\n".join(f"{t},{p},3.3" for t, p in zip(time_s, pulses, strict=True))
    path = tmp_path / "still.csv"
    path.write_text(f"time [s],tacho [V],still [m/s^2]\n{rows}\n", encoding="utf-8")
    outcome = run("orders", path, "--tacho", "tacho", "--channel", "still")
    assert outcome.code == 2
    assert "still.csv: still never changes, so it has no orders; name another channel" in outcome.err
    outcome = run("orders", path, "--tacho", "still")
    assert outcome.code == 2
    assert "still.csv: still never changes, so it tells no rotation" in outcome.err
