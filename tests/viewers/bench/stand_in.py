"""A small instrument, and tools that need nothing but NumPy, so that the pages can be tested alone."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from chladni.models.core.instrument import Instrument, Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Terminal
from chladni.models.core.reading import Chart, Curve, InfluenceTable, InstrumentReading, Quantity
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, ModelError
from chladni.viewers.bench.tools import Export, Rows, Tools, Variant

PARAMETERS = Parameters(
    (
        Parameter(
            name="mass", value=2.0, unit="kg", low=1.0, high=5.0, minimum=0.01, symbol="m", meaning="moving mass"
        ),
        Parameter(
            name="stiffness", value=2e4, unit="N/m", low=5e3, high=5e6, minimum=1.0, symbol="k",
            shown_unit="N/mm", meaning="spring",
        ),
        Parameter(
            name="damping", value=40.0, unit="N s/m", low=5.0, high=200.0, minimum=0.0, maximum=1e4, symbol="c",
            meaning="damper",
        ),
    )
)  # fmt: skip


@dataclass(frozen=True)
class Oscillator:
    """Just enough of a model."""

    values: Mapping[str, float]
    options: Mapping[str, str]
    name: str = "oscillator"


OSCILLATOR = Instrument(
    name="oscillator",
    title="Oscillator <one body>",
    parameters=PARAMETERS,
    build=lambda values, options: Oscillator(values, options),  # type: ignore[arg-type, return-value]
    options=(
        Option(name="load", meaning="load on"),
        Option(name="correction", choices=("none", "pd", "unstable"), default="none"),
    ),
    step_input="force",
    step_output="position",
)


def read(
    instrument: Instrument,
    values: Mapping[str, float],
    options: Mapping[str, str],
    wanted: Collection[str] | None = None,
) -> InstrumentReading:
    """Step, Bode and poles in closed form."""
    model: Any = instrument.model(values, options)
    if options["correction"] == "unstable":
        raise ModelError("the loop with correction 'unstable' has a pole at +3 rad/s; lower its gain")
    m, k, c = (model.values[name] for name in ("mass", "stiffness", "damping"))
    c += 100.0 if options["correction"] == "pd" else 0.0
    omega, zeta = (k / m) ** 0.5, c / (2 * (k * m) ** 0.5)
    t = np.linspace(0, 40 / omega, 600)
    root = (1 - zeta**2 + 0j) ** 0.5
    s1, s2 = omega * (-zeta + 1j * root), omega * (-zeta - 1j * root)
    step = (1 + (s2 * np.exp(s1 * t) - s1 * np.exp(s2 * t)) / (s1 - s2)).real / k
    f = np.geomspace(omega / 60, omega / 0.6, 500)
    h = 1 / (k - m * (2 * pi * f) ** 2 + 2j * pi * f * c)
    poles, decibels = np.array([s1, s2]), 20 * np.log10(abs(h))
    charts = (
        _chart("step.position", "Position after a step of force", "time [s]", "position [m]", t, step),
        _chart("bode.magnitude", "Bode magnitude", "frequency [Hz]", "magnitude [dB]", f, decibels, log=True),
        _chart("bode.phase", "Bode phase", "frequency [Hz]", "phase [deg]", f, np.degrees(np.angle(h)), log=True),
        Chart(
            name="poles", title="Poles", x_label="real [rad/s]", y_label="imaginary [rad/s]", equal=True,
            curves=(Curve(label="poles", x=poles.real, y=poles.imag, points=True),),
        ),
        Chart(
            name="nyquist", title="Nyquist", x_label="real [m/N]", y_label="imaginary [m/N]", equal=True,
            curves=(Curve(label="above", x=h.real, y=h.imag), Curve(label="below", x=h.real, y=-h.imag)),
        ),
    )  # fmt: skip
    flags = tuple(
        f"{one.name} is outside its usual range" for one in instrument.parameters.with_values(values).unusual()
    )
    quantities = (
        Quantity(name="natural frequency", value=omega / 2 / pi, unit="Hz", definition="undamped, of the pole pair"),
        Quantity(name="damping ratio", value=zeta, unit="1", definition="of the pole pair"),
        Quantity(name="overshoot", value=None, unit="%", definition="highest value over the final one"),
    )
    return InstrumentReading(
        charts=tuple(chart for chart in charts if wanted is None or chart.name in wanted),
        quantities=quantities,
        flags=flags,
        offered=tuple((chart.name, chart.title) for chart in charts),
    )


def influence(instrument: Instrument, values: Mapping[str, float], options: Mapping[str, str]) -> InfluenceTable:
    """The closed form: frequency goes with k^(1/2) and m^(-1/2)."""
    exact = np.array([[-0.5, -0.5], [0.5, -0.5], [0.0, 1.0]])
    nominal = np.array([(values["stiffness"] / values["mass"]) ** 0.5 / 2 / pi, np.nan])
    return InfluenceTable(
        behaviour=("natural frequency", "damping ratio"), construction=tuple(instrument.parameters), nominal=nominal,
        change=np.full(3, -0.1), relative_change=-0.1 * exact, finite=exact * 1.02, log_derivative=exact,
        definitions=("undamped", "of the pole pair"),
    )  # fmt: skip


def watch(instrument: Instrument, path: Path) -> Any:
    """One mass a line."""

    def look() -> Rows:
        found = []
        for line in path.read_text().splitlines():
            try:
                mass = float(line)
            except ValueError:
                return Rows(variants=tuple(found), mistake=f"{path.name}: {line!r} is no mass; give a number in kg")
            values = {**instrument.parameters.numbers(), "mass": mass}
            options = {"load": "off", "correction": "none"}
            found.append(Variant(label=f"row m {mass:g}", values=values, options=options))
        return Rows(variants=tuple(found))

    return look


@dataclass
class StandInLog:
    """Reads the names of channels from a text file."""

    path: Path
    title: str
    private: bool
    channels: tuple[Channel, ...] = ()
    duration_s: float = 5.0
    damage: tuple[str, ...] = ()

    def close(self) -> None:
        """Remove a private copy."""
        if self.private:
            self.path.unlink(missing_ok=True)


def open_log(path: Path, title: str, private: bool) -> StandInLog:
    """Open, or refuse."""
    content = path.read_bytes()
    if not content.startswith(b"log\n"):
        raise LogError(f"{title}: is no log; record it as MCAP")
    names = content.decode().splitlines()[1:]
    log = StandInLog(path, title, private)
    return replace(log, channels=tuple(Channel(name=name, unit="N") for name in names))


def terminals(model: Any) -> tuple[tuple[Terminal, ...], tuple[Terminal, ...]]:
    """One input, one output."""
    return (Terminal(name="force", unit="N"),), (Terminal(name="position", unit="m"),)


def compare(model: Any, log: Any, assignment: Mapping[str, str], start_s: float, seconds: float) -> InstrumentReading:
    """Say what was asked for."""
    if "position" not in assignment:
        raise LogError(f"{log.title}: no output is measured; choose the channel of one")
    t = np.linspace(start_s, start_s + seconds, 50)
    curves = tuple(Curve(label=label, x=t, y=np.sin(t)) for label in ("measured", "simulated"))
    chart = Chart(name="log.time", title="position", x_label="time [s]", y_label="position [m]", curves=curves)
    score = Quantity(name="NRMSE position", value=model.values["mass"], unit="%")
    return InstrumentReading(charts=(chart,), quantities=(score,), flags=())


def assign(_model: Any, channels: Sequence[Channel]) -> Mapping[str, str]:
    """Take the first two."""
    return {"force": channels[0].name, "position": channels[1].name} if len(channels) > 1 else {}


def model_file(shown: Any) -> bytes:
    """One line."""
    return f"mass = {shown.model.values['mass']}".encode()


def tools(**changes: Any) -> Tools:
    """All of them, some replaced."""
    export = Export(label="Model file", file_name="{name}.toml", media_type="application/toml", build=model_file)
    made = Tools(
        read=read, influence=influence, watch=watch, open_log=open_log, terminals=terminals, assign=assign,
        compare=compare, exports=(export,),
    )  # fmt: skip
    return replace(made, **changes)


def _chart(name: str, title: str, x_label: str, y_label: str, x: Any, y: Any, *, log: bool = False) -> Chart:
    return Chart(
        name=name, title=title, x_label=x_label, y_label=y_label, x_scale="log" if log else "linear",
        curves=(Curve(label="", x=x, y=np.asarray(y, dtype=np.float64)),),
    )  # fmt: skip
