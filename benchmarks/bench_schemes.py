"""Block schemes: the robot module with and without load, its resonances, and speed against python-control."""

import time
from collections.abc import Callable, Iterator
from itertools import product

import control
import numpy as np
from scipy.linalg import expm

from chladni.models.core.port import Terminal
from chladni.models.elements.realization import state_space
from chladni.models.elements.transfer_function import TransferFunction
from chladni.models.instruments.robot_module import INSTRUMENT
from chladni.models.schemes.block import element_block
from chladni.models.schemes.scheme_model import SchemeModel

REFERENCE_RAD_S, BAND = 0.1, 0.05
SECONDS, STEP_S = 60.0, 0.005
LINES, ROUNDS = 1000, 30


def row_of(model: SchemeModel, point: str) -> int:
    return [one.terminal.name for one in model.points].index(point)


def arm_speed(model: SchemeModel, load: float) -> np.ndarray:
    """Speed of the arm after reference and load step together at 0 s; exact at each instant."""
    system = model.compile().state_space()
    drive = system.b @ [REFERENCE_RAD_S, load]
    order = drive.size
    augmented = np.zeros((order + 1, order + 1))
    augmented[:order, :order], augmented[:order, order] = system.a, drive
    step, state = expm(augmented * STEP_S), np.append(np.zeros(order), 1.0)
    speed = np.empty(round(SECONDS / STEP_S))
    row = row_of(model, "arm")
    for number in range(speed.size):
        speed[number] = system.c[row] @ state[:order]
        state = step @ state
    return speed


def settling_s(speed: np.ndarray, final: float) -> float:
    """When the speed is last outside of 5 % about its final value."""
    outside = np.flatnonzero(np.abs(speed - final) > BAND * abs(final))
    return (outside[-1] + 1) * STEP_S if outside.size else 0.0


def load_rejection() -> Iterator[str]:
    yield "| regulator | correction | load | final speed | of the reference | settles to 5 % within | largest speed |"
    yield "| --- | --- | --- | ---: | ---: | ---: | ---: |"
    for regulator, correction, load in product(("on", "off"), ("on", "off"), ("off", "on")):
        model = INSTRUMENT.model(options={"regulator": regulator, "correction": correction, "load": load})
        static = model.frequency_response(np.zeros(1))[row_of(model, "arm"), :, 0].real
        final = float(static @ [REFERENCE_RAD_S, 1.0])
        speed = arm_speed(model, 1.0)
        settled = settling_s(speed, final)
        yield (
            f"| {regulator} | {correction} | {load} | {final:.6f} rad/s | {final / REFERENCE_RAD_S:.2%} "
            f"| {settled:.2f} s | {speed.max():.4f} rad/s |"
        )


def last_peak(frequency_hz: np.ndarray, magnitude: np.ndarray) -> str:
    """Highest local maximum, or none."""
    inner = (magnitude[1:-1] > magnitude[:-2]) & (magnitude[1:-1] > magnitude[2:])
    places = np.flatnonzero(inner) + 1
    # A constant has maxima too, of rounding.
    if not places.size or np.ptp(magnitude) < 1e-9:
        return "none"
    best = places[np.argmax(magnitude[places])]
    return f"{frequency_hz[best]:.4g} Hz, {magnitude[best]:.3g}"


def resonances() -> Iterator[str]:
    frequency_hz = np.geomspace(0.01, 100, 4001)
    model = INSTRUMENT.model()
    response = np.abs(model.frequency_response(frequency_hz))
    yield "| point | peak from the reference | peak from the load |"
    yield "| --- | ---: | ---: |"
    for row, point in enumerate(model.points):
        told = [last_peak(frequency_hz, response[row, entry]) for entry in range(2)]
        yield f"| {point.terminal.name} | {told[0]} | {told[1]} |"


def wishes() -> Iterator[str]:
    """What moves the first resonance, what lowers a band, where the velocity loop's phase reaches -180 degrees."""
    frequency_hz = np.geomspace(0.01, 100, 20001)
    in_band = (frequency_hz > 5) & (frequency_hz < 9)
    changes: dict[str, tuple[dict[str, float], dict[str, str]]] = {
        "as declared": ({}, {}),
        "shaft twice as stiff": ({"shaft.stiffness": 4e4}, {}),
        "arm half as heavy": ({"arm.inertia": 10.0}, {}),
        "shaft ten times as damped": ({"shaft.damping": 200.0}, {}),
        "correction off": ({}, {"correction": "off"}),
        "correction anticipates (derivative time 0.5 s)": ({"correction.derivative_time": 0.5}, {}),
    }
    yield "| change | first resonance | damping ratio | largest arm/load, 5 to 9 Hz | critical frequency, open loop |"
    yield "| --- | ---: | ---: | ---: | ---: |"
    for name, (values, options) in changes.items():
        model = INSTRUMENT.model(values, options)
        poles = model.compile().state_space().poles()
        # The elastic pair lies above 1 Hz; what lies below belongs to the velocity loop.
        first = min((pole for pole in poles if abs(pole) > 2 * np.pi and pole.imag > 0), key=abs)
        load = np.abs(model.frequency_response(frequency_hz)[row_of(model, "arm"), 1])
        yield (
            f"| {name} | {abs(first) / 2 / np.pi:.3f} Hz | {-first.real / abs(first):.4f} "
            f"| {load[in_band].max():.3g} (rad/s) | {critical_hz(model, frequency_hz)} |"
        )


def critical_hz(model: SchemeModel, frequency_hz: np.ndarray) -> str:
    """Where the phase of the velocity loop, opened behind the tachometer, first reaches -180 degrees."""
    rows = [row_of(model, "tachometer"), row_of(model, "regulator.input")]
    loop = np.divide(*model.frequency_response(frequency_hz)[rows, 0])
    phase = np.unwrap(np.angle(loop))
    below = np.flatnonzero(phase < -np.pi)
    return f"{frequency_hz[below[0]]:.3f} Hz" if below.size else "none"


def five_points() -> SchemeModel:
    return SchemeModel(
        name="five",
        blocks=(
            element_block("regulator", "pi", "+r", "-tacho", gain=2.97, integral_time=9.9),
            element_block("correction", "pdt1", "regulator", derivative_time=0.1, time_constant=0.7),
            element_block("motor", "pt2", "+correction", "-emf", gain=3.0, time_constant=0.2),
            element_block("emf", "p", "motor", gain=0.5),
            element_block("tacho", "pt1", "motor", time_constant=0.01),
        ),
        inputs=(Terminal(name="r", unit="V"),),
    )


def of_control(model: SchemeModel) -> control.StateSpace:
    """Give the same scheme as python-control's users build it; a signal must not have a block's name there."""
    pieces = [_piece(block.name, block.content.transfer) for block in model.blocks]
    sums = []
    for block in model.blocks:
        signals = [
            ("-" if sign < 0 else "") + (f"{name}_out" if name != "r" else name) for name, sign in block.sources
        ]
        sums.append(control.summing_junction(signals, f"{block.name}_in", name=f"sum_{block.name}"))
    return control.interconnect(pieces + sums, inputs=["r"], outputs=[f"{block.name}_out" for block in model.blocks])


def _piece(name: str, transfer: TransferFunction) -> control.StateSpace:
    form = state_space(transfer)
    return control.ss(form.a, form.b, form.c, form.d, name=name, inputs=f"{name}_in", outputs=f"{name}_out")


def fastest_s(works: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Shortest time of each; they take turns, so that all see the same load of the machine."""
    shortest = dict.fromkeys(works, float("inf"))
    for _ in range(ROUNDS):
        for name, work in works.items():
            begun = time.perf_counter()
            work()
            shortest[name] = min(shortest[name], time.perf_counter() - begun)
    return shortest


def speed() -> Iterator[str]:
    model = five_points()
    frequency_hz = np.geomspace(1e-3, 10, LINES)
    oracle = of_control(model)
    omega = 2 * np.pi * frequency_hz
    theirs = oracle(1j * omega)[:, 0]
    ours = model.frequency_response(frequency_hz)[:5, 0]
    compiled = model.compile()
    shortest = fastest_s({
        "every point, from the blocks": lambda: model.frequency_response(frequency_hz),
        "every point, from compiled equations": lambda: compiled.frequency_response(frequency_hz),
        "compile": model.compile,
        "python-control, response": lambda: oracle(1j * omega),
        "python-control, interconnect": lambda: of_control(model),
    })  # fmt: skip
    yield "| work, five points, 1000 lines | time |"
    yield "| --- | ---: |"
    for name, seconds in shortest.items():
        yield f"| {name} | {seconds * 1e3:.2f} ms |"
    yield f"\nLargest difference to python-control: {np.max(np.abs(ours / theirs - 1)):.1e} relative."


def main() -> None:
    for title, table in (
        (f"Robot module: reference {REFERENCE_RAD_S} rad/s and load step together", load_rejection),
        ("Where each point of the robot module resonates", resonances),
        ("What the frequency wishes cost and bring", wishes),
        ("Speed", speed),
    ):
        print(f"## {title}\n", *table(), "", sep="\n")


if __name__ == "__main__":
    main()
