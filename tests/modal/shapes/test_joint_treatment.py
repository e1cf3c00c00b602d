"""The gain of a damper or a spring, checked against the exact eigenvalues of the treated structure."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from chladni.modal.shapes.joint_treatment import best_joint, treatments
from chladni.modal.shapes.relative_motion import relative_motion
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.signals.channel import AXES, Channel
from chladni.signals.engineering import engineering
from chladni.signals.geometry import Geometry, Point
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance

NAMES = ("base", "column", "arm", "wrist")
GEOMETRY = Geometry(points=tuple(Point(name=name, position=(0.0, 0.0, 0.0)) for name in NAMES), lines=(NAMES,))
MASSES = (20.0, 12.0, 5.0, 2.0)
STIFFNESSES = (4e6, 2e6, 6e5, 4e5)


def arm(added: dict[str, tuple[float, float]] | None = None) -> Structure:
    """A chain from the ground with damping proportional to stiffness, and more in the joints that are treated."""
    ends = ("ground", *NAMES)
    joints = []
    for row, stiffness in enumerate(STIFFNESSES):
        more = (added or {}).get(NAMES[row], (0.0, 0.0))
        joints.append(
            Joint(
                name=f"below_{NAMES[row]}",
                between=(ends[row], ends[row + 1]),
                stiffness=stiffness + more[0],
                damping=5e-5 * stiffness + more[1],
            )
        )
    bodies = tuple(Body(name=name, mass=mass) for name, mass in zip(NAMES, MASSES, strict=True))
    return Structure(bodies=bodies, joints=tuple(joints))


def scaled_modes() -> ModeSet:
    """The arm's modes in closed form, with the modal masses phi^T M phi of its real shapes."""
    true = arm().natural_modes()
    shapes = true.shapes.real.astype(complex)
    mass = np.sum(np.array(MASSES) * shapes.real**2, axis=1)
    count = mass.size
    channels = tuple(Channel(name=f"/{name}.a", unit="m/s^2", point=name, direction=AXES["+x"]) for name in NAMES)
    omega_d = 2 * np.pi * true.frequency_hz * np.sqrt(1 - true.damping_ratio**2)
    return ModeSet(
        frequency_hz=true.frequency_hz,
        frequency_std_hz=np.full(count, 1e-3),
        damping_ratio=true.damping_ratio,
        damping_std=np.full(count, 1e-5),
        shapes=shapes,
        shape_std=np.full(shapes.shape, 1e-3 * (1 + 1j)),
        channels=channels,
        references=(Channel(name="hammer", unit="N", role="reference"),),
        participation=np.ones((count, 1), complex),
        scale=ModalScale(
            response="/wrist.a",
            reference="hammer",
            modal_a=2j * omega_d * mass,
            modal_mass=mass,
            modal_mass_std=0.03 * mass,
        ),
        provenance=Provenance(),
    )


@pytest.mark.parametrize(("first", "second"), [("base", "column"), ("column", "arm"), ("arm", "wrist")])
@pytest.mark.parametrize("mode", range(4))
def test_gains_are_the_derivatives_of_the_exact_eigenvalues(first: str, second: str, mode: int) -> None:
    modes = scaled_modes()
    motion = next(
        one for one in relative_motion(modes, GEOMETRY) if one.mode == mode and one.between == (first, second)
    )
    assert motion.damping_gain is not None
    assert motion.stiffness_gain_hz is not None
    before = arm().natural_modes()
    # Small enough for the linear law: errors go with the square of the step and with the damping ratio (1 %).
    damped = arm({second: (0.0, 0.5)}).natural_modes()
    stiffened = arm({second: (50.0, 0.0)}).natural_modes()
    change = damped.damping_ratio[mode] - before.damping_ratio[mode]
    shift_hz = stiffened.frequency_hz[mode] - before.frequency_hz[mode]
    tolerance = 4 * float(before.damping_ratio[mode])
    assert 0.5 * motion.damping_gain == pytest.approx(change, rel=tolerance, abs=1e-12)
    assert 50.0 * motion.stiffness_gain_hz == pytest.approx(shift_hz, rel=tolerance, abs=1e-9)


def test_the_first_order_error_falls_with_the_square_of_the_damper() -> None:
    modes = scaled_modes()
    motion = next(
        one for one in relative_motion(modes, GEOMETRY) if one.mode == 0 and one.between == ("column", "arm")
    )
    assert motion.stiffness_gain_hz is not None
    base = arm().natural_modes().frequency_hz[0]
    errors = []
    for stiffness in (4e4, 2e4):
        exact = arm({"arm": (stiffness, 0.0)}).natural_modes().frequency_hz[0] - base
        errors.append(stiffness * motion.stiffness_gain_hz - exact)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_the_joint_named_is_the_one_that_helps_most() -> None:
    modes = scaled_modes()
    found = treatments(modes, relative_motion(modes, GEOMETRY))
    assert [one.mode for one in found] == [0, 1, 2, 3]
    for one in found:
        exact = {second: arm({second: (0.0, 1.0)}).natural_modes().damping_ratio[one.mode] for second in NAMES[1:]}
        assert one.between[1] == max(exact, key=lambda name: exact[name])


def test_the_damper_named_doubles_the_damping() -> None:
    modes = scaled_modes()
    for one in treatments(modes, relative_motion(modes, GEOMETRY)):
        assert one.damper is not None
        assert one.spring is not None
        after = arm({one.between[1]: (0.0, one.damper)}).natural_modes()
        # Damping ratios here are 0.4 to 2 %: the second-order part is a few percent of the change.
        assert after.damping_ratio[one.mode] == pytest.approx(2 * modes.damping_ratio[one.mode], rel=0.1)
        words = f"a damper of {engineering(one.damper, None, 'N s/m')} between the two would double the damping"
        assert words in one.sentence
        assert one.sentence.startswith(f"Mode {one.mode + 1} (")


def test_error_bar_of_the_gain() -> None:
    modes = scaled_modes()
    one = treatments(modes, relative_motion(modes, GEOMETRY))[0]
    assert one.damping_gain is not None
    assert one.ratio_std is not None
    expected = one.damping_gain * sqrt((2 * one.ratio_std / one.ratio) ** 2 + 0.03**2)
    assert one.damping_gain_std == pytest.approx(expected)


def test_the_best_joint_is_that_of_the_sharpest_mode_unless_one_is_named() -> None:
    modes = scaled_modes()
    motions = relative_motion(modes, GEOMETRY)
    best = best_joint(modes, motions)
    assert best is not None
    assert best.mode == int(np.argmin(modes.damping_ratio))
    third = best_joint(modes, motions, mode=2)
    assert third is not None
    assert third.mode == 2
    assert best_joint(modes, (), mode=2) is None


def test_unscaled_modes_name_the_joint_and_what_is_missing() -> None:
    modes = replace(scaled_modes(), scale=None)
    one = treatments(modes, relative_motion(modes, GEOMETRY))[0]
    assert one.damper is None
    assert one.damping_gain_std is None
    assert "treat that joint first" in one.sentence
    assert "measure a driving point" in one.sentence


def test_motion_within_its_error_bar_is_no_joint() -> None:
    modes = scaled_modes()
    blurred = replace(modes, shape_std=np.full(modes.shapes.shape, 3.0 * (1 + 1j)))
    assert treatments(blurred, relative_motion(blurred, GEOMETRY)) == ()
    assert best_joint(blurred, relative_motion(blurred, GEOMETRY)) is None


def test_gains_of_complex_modes_are_the_derivatives_of_the_exact_eigenvalues() -> None:
    # A strong damper in one joint of three makes the modes complex, one of them with a collinearity of 0.8.
    mass, stiffness = np.diag([2.0, 1.0, 3.0]), _tied([4e4, 2e4, 3e4])
    damping = _tied([5.0, 120.0, 2.0])
    pole, shape = _poles(mass, damping, stiffness)
    # psi^T (2 lambda M + C) psi, the residue's denominator.
    modal_a = np.einsum("ri,rij,rj->r", shape, 2 * pole[:, None, None] * mass + damping, shape)
    channels = tuple(Channel(name=f"/{name}.a", unit="m/s^2", point=name, direction=AXES["+x"]) for name in NAMES[1:])
    modes = ModeSet(
        frequency_hz=np.abs(pole) / (2 * np.pi),
        frequency_std_hz=np.full(3, 1e-3),
        damping_ratio=-pole.real / np.abs(pole),
        damping_std=np.full(3, 1e-5),
        shapes=shape,
        shape_std=np.zeros((3, 3), complex),
        channels=channels,
        references=(Channel(name="hammer", unit="N", role="reference"),),
        participation=np.ones((3, 1), complex),
        scale=ModalScale(
            response=channels[0].name,
            reference="hammer",
            modal_a=modal_a,
            modal_mass=(modal_a / (2j * pole.imag)).real,
            modal_mass_std=np.zeros(3),
        ),
        provenance=Provenance(),
    )
    step = np.array([[0.0, 0, 0], [0, 1, -1], [0, -1, 1]])
    damped, _ = _poles(mass, damping + 1e-3 * step, stiffness)
    stiffened, _ = _poles(mass, damping, stiffness + 1e-1 * step)
    gains = {one.mode: one for one in relative_motion(modes, GEOMETRY) if one.between == NAMES[2:4]}
    added = (-damped.real / np.abs(damped) - modes.damping_ratio) / 1e-3
    shifted_hz = (np.abs(stiffened) / (2 * np.pi) - modes.frequency_hz) / 1e-1
    # Steps of 1e-5 of the joint's own damper and spring leave the linear law as good as that.
    np.testing.assert_allclose([gains[mode].damping_gain for mode in range(3)], added, rtol=1e-4)
    np.testing.assert_allclose([gains[mode].stiffness_gain_hz for mode in range(3)], shifted_hz, rtol=1e-4)


def _tied(values: list[float]) -> np.ndarray:
    """Matrix of a chain from the ground."""
    ends = np.eye(3) - np.eye(3, k=-1)
    return np.asarray(ends.T @ np.diag(values) @ ends)


def _poles(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poles by rising frequency, and shapes ``[mode, mass]`` with the largest component 1."""
    state = np.block(
        [[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]]
    )
    values, vectors = np.linalg.eig(state)
    order = [row for row in np.argsort(np.abs(values)) if values[row].imag > 0]
    shapes = vectors[:3, order].T
    largest = np.argmax(np.abs(shapes), axis=1)[:, None]
    return values[order], shapes / np.take_along_axis(shapes, largest, axis=1)
