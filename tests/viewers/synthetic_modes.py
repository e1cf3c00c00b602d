"""Studies of modes that are known in closed form: a robot arm, a plate, a ring, and none at all."""

from dataclasses import replace
from functools import cache

import numpy as np

from chladni.models.structures.robot_arm import robot_arm
from chladni.models.structures.structure import Structure
from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry, Point
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.modal_fit import ModalFit
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.order_spread import OrderSpread
from chladni.signals.provenance import Provenance
from chladni.signals.relative_motion import RelativeMotion
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.study import Study
from tests.viewers.synthetic import PROVENANCE, SEGMENT_S

SHAKER = Channel(name="/shaker.wrench.force.x", unit="N", point="tool", direction=(1.0, 0.0, 0.0), role="reference")
MODES_PROVENANCE = Provenance(
    estimator="made up",
    window="hann",
    segment_s=SEGMENT_S,
    averages=19,
    effective_averages=17.4,
    notes=("An advice.",),
)


@cache
def arm_study() -> Study:
    """The robot arm: exact modes, transfer functions with 2 % of noise, all poles of orders 2 to 40."""
    structure = robot_arm()
    f = np.arange(20, 800) * 0.25
    exact = structure.accelerance(f)[:, 4:]
    rng = np.random.default_rng(1756)
    noise = rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape)
    channels = tuple(
        Channel(name=f"/{body.name}.accel.linear.x", unit="m/s^2", point=body.name, direction=(1.0, 0.0, 0.0))
        for body in structure.bodies
    )
    response = FrequencyResponse(
        frequency_hz=f,
        values=exact + 0.02 * np.abs(exact) * noise,
        std=0.02 * np.abs(exact),
        coherence=np.full((5, f.size), 0.998),
        excited=np.ones(f.size, dtype=np.bool_),
        responses=channels,
        references=(SHAKER,),
        provenance=PROVENANCE.with_estimator("H1"),
    )
    modes = _arm_modes(structure, channels, response, exact)
    names = [body.name for body in structure.bodies]
    return Study(
        title="arm.mcap",
        response=response,
        modes=modes,
        validation=validation(modes),
        relative_motion=motions(modes),
        geometry=Geometry(
            points=tuple(Point(name=body.name, position=body.position) for body in structure.bodies),
            lines=(tuple(names),),
        ),
    )


def _arm_modes(
    structure: Structure, channels: tuple[Channel, ...], response: FrequencyResponse, exact: Complex
) -> ModeSet:
    natural = structure.natural_modes()
    count = natural.frequency_hz.size
    modal_a = modal_a_of(structure)
    omega_d = 2 * np.pi * natural.frequency_hz * np.sqrt(1 - natural.damping_ratio**2)
    mass = (modal_a / (2j * omega_d)).real
    std = np.full((count, 5), 0.01 * (1 + 1j))
    std[np.abs(natural.shapes - 1) < 1e-12] = 0
    error = np.abs(response.values - exact) ** 2
    return ModeSet(
        frequency_hz=natural.frequency_hz,
        frequency_std_hz=natural.frequency_hz * 2e-4,
        damping_ratio=natural.damping_ratio,
        damping_std=natural.damping_ratio * 0.015,
        shapes=natural.shapes,
        shape_std=std,
        channels=channels,
        references=(SHAKER,),
        participation=natural.shapes[:, 4:] / modal_a[:, None],
        scale=ModalScale(
            response=channels[4].name,
            reference=SHAKER.name,
            modal_a=modal_a,
            modal_mass=mass,
            modal_mass_std=0.02 * mass,
        ),
        spread=OrderSpread(
            orders=np.arange(20, 20 + count),
            frequency_hz=natural.frequency_hz,
            frequency_std_hz=natural.frequency_hz * 1e-4,
            damping_ratio=natural.damping_ratio,
            damping_std=natural.damping_ratio * 0.01,
        ),
        harmonics=(MachineHarmonic(frequency_hz=120.0, reason="kurtosis 1.52 where noise has 3"),),
        fit=ModalFit(
            frequency_hz=response.frequency_hz,
            synthesised=exact,
            lower_residual=np.zeros((5, 1), dtype=complex),
            upper_residual=np.zeros((5, 1), dtype=complex),
            error=0.028,
            function_error=np.sqrt(error.sum(axis=2) / (np.abs(response.values) ** 2).sum(axis=2)),
            bands_hz=np.column_stack([natural.frequency_hz - 5, natural.frequency_hz + 5]),
            band_error=np.full(count, 0.028),
            poles_hz=natural.frequency_hz,
        ),
        stabilisation=stabilisation(natural.frequency_hz, natural.damping_ratio, response),
        provenance=MODES_PROVENANCE,
    )


def modal_a_of(structure: Structure) -> Complex:
    """psi^T (2 lambda M + C) psi of each mode (Maia & Silva 1997, section 2.4)."""
    natural = structure.natural_modes()
    omega = 2 * np.pi * natural.frequency_hz
    poles = -natural.damping_ratio * omega + 1j * omega * np.sqrt(1 - natural.damping_ratio**2)
    inner = 2 * poles[:, None, None] * structure.mass_matrix() + structure.damping_matrix()
    return np.asarray(np.einsum("ri,rij,rj->r", natural.shapes, inner, natural.shapes))


def stabilisation(natural_hz: Real, damping_ratio: Real, response: FrequencyResponse) -> StabilisationDiagram:
    """Each mode is stable from an order of its own on; a few poles of noise at each order are not."""
    rng = np.random.default_rng(1809)
    rows = []
    for order in range(2, 41):
        for mode, (hertz, zeta) in enumerate(zip(natural_hz, damping_ratio, strict=True)):
            age = order - 3 * (mode + 1)
            if age >= 0:
                scatter = 1 + rng.standard_normal(2) * np.array([3e-3, 0.2]) / (1 + age)
                status = min(age, 3)
                rows.append((order, hertz * scatter[0], zeta * scatter[1], status, mode if status == 3 else -1))
        rows += [(order, hertz, 0.05, 0, -1) for hertz in rng.uniform(8, 195, order // 8)]
    order, hertz, zeta, status, mode = (np.array(column) for column in zip(*rows, strict=True))
    values = np.moveaxis(response.values, 2, 0)
    first = np.linalg.svd(values, compute_uv=False)[:, 0]
    return StabilisationDiagram(
        order=order,
        frequency_hz=hertz,
        damping_ratio=zeta,
        status=status,
        mode=mode,
        indicator_hz=response.frequency_hz,
        indicator=np.vstack([first, first / 30]),
        indicator_name="CMIF",
        indicator_unit="(m/s^2)/N",
    )


def validation(modes: ModeSet) -> ModeValidation:
    cross = np.abs(modes.shapes.conj() @ modes.shapes.T) ** 2
    power = np.diag(cross) ** 0.5
    count = modes.frequency_hz.size
    return ModeValidation(
        auto_mac=cross / np.outer(power, power),
        mpc=np.linspace(0.999, 0.97, count),
        mpd_deg=np.linspace(0.4, 4.0, count),
        mean_phase_deg=np.linspace(-1.0, 1.0, count),
        alike=(),
        findings=(f"{count} modes, all shapes are told apart.", "Mode 5 rests on few orders.") if count else (),
    )


def motions(modes: ModeSet) -> tuple[RelativeMotion, ...]:
    found = [
        RelativeMotion(
            mode=mode,
            between=(str(first.point or first.name), str(second.point or second.name)),
            ratio=float(np.abs(shape[place] - shape[place + 1])),
            ratio_std=0.01,
            damping_gain=1e-5,
            stiffness_gain_hz=2e-6,
        )
        for mode, shape in enumerate(modes.shapes)
        for place, (first, second) in enumerate(zip(modes.channels[:-1], modes.channels[1:], strict=True))
    ]
    return tuple(sorted(found, key=lambda motion: -(motion.ratio or 0)))


def made_modes(shapes: Complex, channels: tuple[Channel, ...], first_hz: float = 10.0) -> ModeSet:
    """Modes from responses alone, 7 Hz apart, with the shapes given."""
    count = len(shapes)
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1, keepdims=True), axis=1)
    frequency_hz = first_hz + 7.03 * np.arange(count)
    return ModeSet(
        frequency_hz=frequency_hz,
        frequency_std_hz=np.full(count, 0.01),
        damping_ratio=np.full(count, 0.0123),
        damping_std=np.full(count, 0.0004),
        shapes=shapes / largest,
        shape_std=np.full(shapes.shape, 0.02 + 0.02j),
        channels=channels,
        provenance=Provenance(estimator="made up"),
    )


def plate_study(columns: int = 20, rows: int = 15, count: int = 20) -> Study:
    """A plate that moves across its plane, a channel a point: 300 channels and 20 modes unless told otherwise."""
    y, x = (grid.ravel() for grid in np.mgrid[0:rows, 0:columns])
    points = tuple(
        Point(name=f"p{place}", position=(0.1 * float(i), 0.1 * float(j), 0.0))
        for place, (i, j) in enumerate(zip(x, y, strict=True))
    )
    channels = tuple(
        Channel(name=f"/plate/{point.name}.z", unit="m/s^2", point=point.name, direction=(0.0, 0.0, 1.0))
        for point in points
    )
    orders = sorted(
        ((m, n) for m in range(1, 9) for n in range(1, 9)), key=lambda order: order[0] ** 2 + order[1] ** 2
    )
    shapes = np.array(
        [
            np.cos(m * np.pi * x / max(columns - 1, 1)) * np.cos(n * np.pi * y / max(rows - 1, 1)) + 0j
            for m, n in orders[:count]
        ]
    )
    grid = np.arange(rows * columns).reshape(rows, columns)
    strokes = [*grid.tolist(), *grid.T.tolist()]
    modes = made_modes(shapes, channels)
    return Study(
        title="plate.mcap",
        modes=modes,
        validation=validation(modes),
        relative_motion=motions(modes),
        geometry=Geometry(
            points=points, lines=tuple(tuple(points[place].name for place in stroke) for stroke in strokes)
        ),
    )


def ring_study() -> Study:
    """A ring with two waves that run round it, one each way: complex modes."""
    angle = 2 * np.pi * np.arange(16) / 16
    points = tuple(
        Point(name=f"r{place}", position=(float(np.cos(a)), float(np.sin(a)), 0.0)) for place, a in enumerate(angle)
    )
    channels = tuple(
        Channel(name=f"/ring/{point.name}.z", unit="m/s^2", point=point.name, direction=(0.0, 0.0, 1.0))
        for point in points
    )
    modes = made_modes(np.array([np.exp(-2j * angle), np.exp(2j * angle)]), channels)
    names = [point.name for point in points]
    return Study(
        title="ring.mcap",
        modes=modes,
        validation=validation(modes),
        geometry=Geometry(points=points, lines=((*names, names[0]),)),
    )


def without_modes() -> Study:
    """Modes were looked for and none was found."""
    nothing = made_modes(np.zeros((0, 5), dtype=np.complex128), modes_of(arm_study()).channels)
    noted = replace(nothing, provenance=Provenance(estimator="made up", notes=("No pole repeats over the orders.",)))
    return Study(title="noise.mcap", modes=noted, validation=validation(noted))


def one_mode() -> Study:
    """The arm's first mode alone, from responses alone."""
    modes = modes_of(arm_study())
    alone = made_modes(modes.shapes[:1], modes.channels)
    return replace(Study(title="one.mcap", modes=alone, validation=validation(alone)), geometry=arm_study().geometry)


def without_geometry() -> Study:
    """The arm without the places of its sensors."""
    return replace(arm_study(), geometry=Geometry())


def modes_of(study: Study) -> ModeSet:
    assert study.modes is not None
    return study.modes
