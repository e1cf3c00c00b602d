"""Where an F-16 is nonlinear, from a ground vibration test at four levels and no model at all.

Noël & Schoukens (2017) shook the right wing at 12 to 98 N RMS and measured three accelerations. The modes of the
lowest level stand in for a simulation; what the higher levels differ by is located at a sensor or between two, and
told odd from even. How: docs/methods/gap-between-sensors.md. The authors say clearance and friction in the connection
of wing and payload, between ``wing_rail`` and ``payload_rail``.

Needs ``f16_level1.mcap`` to ``f16_level7.mcap`` in the folder that CHLADNI_DATA names, or in ../shared/data. Give a
file name as argument to keep the picture.
"""

import os
import sys
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import chladni
from chladni import LevelLocation, Measurement, compare_levels, locate_from_levels

LEVELS = (1, 3, 5, 7)
FORCE = "/shaker.wrench.force.z"
SENSORS = {name: f"/{name}.accel.linear.z" for name in ("excitation", "wing_rail", "payload_rail")}
# Lines of a spectrum that are drawn as one point.
SMOOTHED = 10
SHOWN_HZ = 45.0


def located(folder: Path) -> LevelLocation:
    """Read the four logs and locate."""
    with ExitStack() as opened:
        logs = [opened.enter_context(chladni.open_log(folder / f"f16_level{level}.mcap")) for level in LEVELS]
        return locate_from_levels(logs, force=FORCE, sensors=SENSORS, driving_point="excitation")


def draw(found: LevelLocation, path: Path) -> None:
    """Draw what changes, which motion it follows, and what lies above the band."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplot_mosaic([["change", "motion"], ["outside", "outside"]], figsize=(11, 8), layout="tight")
    draw_change(found, axes["change"])
    draw_motions(found, axes["motion"])
    draw_outside(found, axes["outside"])
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_change(found: LevelLocation, axes) -> None:
    """Response of the payload at every level."""
    shades = ("#9ecae1", "#4292c6", "#08519c", "black")
    for one, newtons, shade in zip(found.responses, found.location.level, shades, strict=True):
        lines = one.excited & (one.frequency_hz < 10.5)
        row = list(SENSORS).index("payload_rail")
        axes.semilogy(
            one.frequency_hz[lines], np.abs(one.values[row, 0, lines]), color=shade, label=f"{newtons:.0f} N RMS",
            linewidth=1.3,
        )  # fmt: skip
    axes.set(xlabel="frequency [Hz]", ylabel="payload_rail over force [(m/s²)/N]", title="What changes with level")
    axes.legend()
    axes.grid(alpha=0.3)


def draw_motions(found: LevelLocation, axes) -> None:
    """Share that a law of each motion explains on lines which its fit hasn't seen."""
    sites = found.location.sites[::-1]
    shares = np.array([100 * site.motion for site in sites])
    ends = np.array([[100 * end for end in site.interval] for site in sites])
    colours = ["C1" if site == found.location.located else "0.7" for site in sites]
    axes.barh(
        [" – ".join(site.names) for site in sites], shares, color=colours, xerr=np.abs(ends.T - shares), capsize=3,
        error_kw={"ecolor": "0.3", "elinewidth": 1},
    )  # fmt: skip
    axes.set(xlabel="explained on unseen lines [%], with 95 % interval", title="Which motion the change follows")
    axes.set_xlim(0, 1.1 * ends.max())
    axes.grid(alpha=0.3, axis="x")


def draw_outside(found: LevelLocation, axes) -> None:
    """Motion between wing and payload at the highest level, beside its noise."""
    loudest, names = found.measurements[-1], list(SENSORS)
    frequency_hz, repeated, noise = spectrum(
        loudest, loudest.outputs[names.index("payload_rail")] - loudest.outputs[names.index("wing_rail")]
    )
    response = found.responses[-1]
    low, high = response.frequency_hz[response.excited][[0, -1]]
    axes.axvspan(low, high, color="0.92", label="excited")
    axes.semilogy(frequency_hz, repeated, color="C1", label="repeats in every period")
    axes.semilogy(frequency_hz, noise, color="0.4", linestyle="--", label="noise")
    axes.set(
        xlabel="frequency [Hz]", ylabel="payload_rail − wing_rail [m/s², RMS a line]", xlim=(0, SHOWN_HZ),
        title=f"{found.location.level[-1]:.0f} N: above the band only a nonlinearity moves the structure",
    )  # fmt: skip
    outside = found.location.outside
    if outside is not None:
        told = (
            f"Motion {' – '.join(outside.motion)} above the band:\n"
            f"{outside.odd:.0%} follow only its odd functions, {outside.even:.0%} only even ones"
        )
        axes.text(
            0.66,
            0.53,
            told,
            transform=axes.transAxes,
            ha="center",
            va="center",
            bbox={"facecolor": "white", "edgecolor": "0.8"},
        )
    axes.set_ylim(top=0.2)
    axes.legend(loc="upper right", ncols=3)
    axes.grid(alpha=0.3)


def spectrum(one: Measurement, signal: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """RMS a line of what repeats and of what doesn't, over some lines at a time."""
    samples = int(one.period_samples or signal.size)
    periods = signal[: signal.size // samples * samples].reshape(-1, samples)[one.transient_periods :]
    spectra = np.fft.rfft(periods, axis=1)[:, 1:] * (np.sqrt(2) / samples)
    noise = spectra.var(axis=0, ddof=1) / len(periods)
    repeated = np.abs(spectra.mean(axis=0)) ** 2
    count = round(SHOWN_HZ / one.sample_rate_hz * samples) // SMOOTHED
    blocks = [part[: count * SMOOTHED].reshape(count, SMOOTHED).mean(axis=1) for part in (repeated, noise)]
    frequency_hz = (1 + np.arange(count) * SMOOTHED + (SMOOTHED - 1) / 2) * one.sample_rate_hz / samples
    return frequency_hz, np.sqrt(blocks[0]), np.sqrt(blocks[1])


def main() -> None:
    """Locate, print the answer, draw."""
    folder = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    missing = [name for name in (f"f16_level{level}.mcap" for level in LEVELS) if not (folder / name).exists()]
    if missing:
        print(f"{folder / missing[0]} is not there; set CHLADNI_DATA to the folder of measured logs")
        return
    found = located(folder)
    modes = ", ".join(f"{one:.2f}" for one in found.modes.frequency_hz)
    print(f"modes at {found.location.level[0]:.1f} N RMS, which stand in for a model: {modes} Hz")
    for sentence in found.location.sentences():
        print("-", sentence)
    print("what changes with level:")
    for sentence in compare_levels(found.measurements):
        print("-", sentence)
    with TemporaryDirectory() as scratch:
        path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(scratch) / "f16-gap.png"
        draw(found, path)
        print(f"picture: {path}" if len(sys.argv) > 1 else "give a file name to keep the picture")


if __name__ == "__main__":
    main()
