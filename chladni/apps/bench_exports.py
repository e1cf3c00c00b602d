"""What a page of the bench can save: model file, pictures, a simulated log."""

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from chladni.models.core.reading import InstrumentReading
from chladni.signals.errors import ModelError
from chladni.viewers.bench.tools import Export, Shown

#: Samples of an exported log: enough for the fastest motion that the charts show.
SAMPLES = 8192
#: Where no chart says how long a step takes.
SECONDS = 10.0


def exports() -> tuple[Export, ...]:
    """Give all, in the order of the buttons."""
    return (
        Export(label="Model file", file_name="{name}.toml", media_type="application/toml", build=model_file),
        Export(label="PNG", file_name="{name}.png", media_type="image/png", build=partial(picture, "png")),
        Export(label="SVG", file_name="{name}.svg", media_type="image/svg+xml", build=partial(picture, "svg")),
        Export(label="Log", file_name="{name}.mcap", media_type="application/octet-stream", build=step_log),
    )


def model_file(shown: Shown) -> bytes:
    """Give the model file of a setting.

    Raises
    ------
    ModelError
        When the model has something that a file can't hold.
    """
    from chladni.models.files.model_file import write_model

    return _written("model.toml", lambda path: write_model(shown.model, path))


def step_log(shown: Shown) -> bytes:
    """Give an MCAP log of the instrument's step, as the sensors would record it.

    Raises
    ------
    ModelError
        When the instrument has no input to step.
    """
    from chladni.io.mcap.writer import write_mcap
    from chladni.models.excitations.step import Step
    from chladni.models.integrator.simulate import simulate

    instrument = shown.instrument
    if not instrument.step_input:
        raise ModelError(f"{instrument.name} has no input to step; use chladni simulate with the model file")
    seconds = step_seconds(shown.reading)
    simulation = simulate(
        shown.model,
        {instrument.step_input: Step(size=instrument.step_size)},
        duration_s=seconds,
        sample_rate_hz=SAMPLES / seconds,
    )
    return _written("step.mcap", lambda path: write_mcap([simulation.inputs, simulation.outputs], path))


def step_seconds(reading: InstrumentReading) -> float:
    """Give the length of the step responses that are drawn."""
    # The charts chose a length in which the motion settles.
    lengths = [
        float(curve.x[-1])
        for chart in reading.charts
        if chart.name.startswith("step.")
        for curve in chart.curves
        if curve.x.size and not curve.points
    ]
    return max(lengths, default=SECONDS) or SECONDS


def picture(kind: str, shown: Shown) -> bytes:
    """Give the charts on the page, one under another, as ``png`` or ``svg``."""
    from chladni.viewers.figures.chart import charts_figure
    from chladni.viewers.figures.rendering import rendered

    return rendered(charts_figure(shown.charts), kind)


def _written(name: str, write: Callable[[Path], object]) -> bytes:
    # Writers write files, whole or not at all; the browser wants bytes.
    with tempfile.TemporaryDirectory(prefix="chladni-") as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()
