from math import pi, sqrt

import numpy as np
import pytest

from chladni.models.structures.structure import Body, Joint, Structure
from chladni.signals.errors import ModelError


def chain(count: int, *, mass: float = 2.0, stiffness: float = 3e4, damping: float = 0.0) -> Structure:
    """Bodies in a row, each joined to the one before, the first one to the ground."""
    names = ["ground", *(f"m{number}" for number in range(count))]
    return Structure(
        bodies=tuple(Body(name=name, mass=mass) for name in names[1:]),
        joints=tuple(
            Joint(name=f"j{number}", between=(names[number], names[number + 1]), stiffness=stiffness, damping=damping)
            for number in range(count)
        ),
    )


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_chain_frequencies_follow_the_closed_form(count: int) -> None:
    # Fixed-free uniform chain: omega_r = 2 sqrt(k/m) sin((2r - 1) pi / (2 (2n + 1))).
    order = np.arange(1, count + 1)
    expected = 2 * sqrt(3e4 / 2.0) * np.sin((2 * order - 1) * pi / (2 * (2 * count + 1))) / (2 * pi)
    np.testing.assert_allclose(chain(count).natural_modes().frequency_hz, expected, rtol=1e-9)


@pytest.mark.parametrize("count", [3, 4, 7])
def test_ring_frequencies_follow_the_closed_form(count: int) -> None:
    # Equal masses in a ring of equal springs: omega_r = 2 sqrt(k/m) sin(r pi/n), r = 0 turns as a whole.
    names = [f"m{number}" for number in range(count)]
    ring = Structure(
        bodies=tuple(Body(name=name, mass=2.0) for name in names),
        joints=tuple(
            Joint(name=f"j{number}", between=(name, names[(number + 1) % count]), stiffness=3e4, damping=0.0)
            for number, name in enumerate(names)
        ),
    )
    order = np.arange(1, count)
    expected = np.sort(2 * sqrt(3e4 / 2.0) * np.sin(order * pi / count) / (2 * pi))
    np.testing.assert_allclose(ring.natural_modes().frequency_hz, expected, rtol=1e-7)


def test_tree_frequencies_follow_the_closed_form() -> None:
    # A trunk M with n equal branches (k, m): n - 1 modes in which the trunk rests, omega^2 = k/m, and two of the
    # trunk with all branches together: M m w^4 - ((K + n k) m + k M) w^2 + K k = 0.
    trunk, mass, stem, twig, count = 5.0, 0.8, 2e5, 3e4, 4
    tree = Structure(
        bodies=(Body(name="trunk", mass=trunk), *(Body(name=f"twig{n}", mass=mass) for n in range(count))),
        joints=(
            Joint(name="root", between=("ground", "trunk"), stiffness=stem, damping=0.0),
            *(Joint(name=f"j{n}", between=("trunk", f"twig{n}"), stiffness=twig, damping=0.0) for n in range(count)),
        ),
    )
    polynomial = [trunk * mass, -((stem + count * twig) * mass + twig * trunk), stem * twig]
    squares = np.sort([*np.roots(polynomial), *([twig / mass] * (count - 1))])
    np.testing.assert_allclose(tree.natural_modes().frequency_hz, np.sqrt(squares) / (2 * pi), rtol=1e-7)


def test_stiffness_proportional_damping_gives_ratios_that_rise_with_frequency() -> None:
    modes = chain(4, damping=6.0).natural_modes()
    # C = beta K with beta = 6/3e4: zeta_r = beta omega_r / 2.
    np.testing.assert_allclose(modes.damping_ratio, 6.0 / 3e4 * pi * modes.frequency_hz, rtol=1e-9)


def test_receptance_of_one_mass_is_the_textbook_formula() -> None:
    frequency_hz = np.linspace(0.0, 50.0, 101)
    omega = 2 * pi * frequency_hz
    found = chain(1, damping=5.0).receptance(frequency_hz)[0, 0]
    np.testing.assert_allclose(found, 1 / (3e4 - 2.0 * omega**2 + 5j * omega), rtol=1e-12)


def test_acceleration_of_a_sine_force_has_the_accelerance_as_amplitude() -> None:
    structure, rate_hz, tone_hz = chain(3, damping=5.0), 512.0, 8.0
    time_s = np.arange(1024) / rate_hz
    moved = structure.acceleration(np.cos(2 * pi * tone_hz * time_s), at="m2", sample_rate_hz=rate_hz)
    expected = structure.accelerance(np.array([tone_hz]))[:, 2, 0]
    np.testing.assert_allclose(
        moved, np.real(expected[:, None] * np.exp(2j * pi * tone_hz * time_s)), atol=1e-12 * np.abs(expected).max()
    )


def test_a_free_structure_accelerates_as_its_total_mass() -> None:
    free = Structure(
        bodies=(Body(name="a", mass=1.0), Body(name="b", mass=3.0)),
        joints=(Joint(name="j", between=("a", "b"), stiffness=1e4, damping=1.0),),
    )
    np.testing.assert_allclose(free.accelerance(np.array([0.01]))[:, 0, 0].real, 0.25, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"joints": (Joint(name="j", between=("ground", "c"), stiffness=1.0, damping=0.0),)},
            "no body 'c'; bodies: a",
        ),
        ({"bodies": (Body(name="a", mass=1.0),) * 2}, "'a' is taken"),
        ({"bodies": (Body(name="ground", mass=1.0),)}, "'ground' is reserved"),
        (
            {"joints": (Joint(name="j", between=("a", "a"), stiffness=1.0, damping=0.0),)},
            "both ends are 'a'; a joint joins two different ones",
        ),
        (
            {
                "bodies": (Body(name="a", mass=1.0), Body(name="b", mass=1.0, motion="rotation")),
                "joints": (Joint(name="j", between=("a", "b"), stiffness=1.0, damping=0.0),),
            },
            "'a' and 'b' can't be joined, one translates and one rotates",
        ),
    ],
)
def test_impossible_structures_are_refused(change: dict[str, tuple[Body, ...]], words: str) -> None:
    parts = {"bodies": (Body(name="a", mass=1.0),), "joints": ()} | change
    with pytest.raises(ModelError, match=words):
        Structure(**parts)


def test_joints_are_found_by_name() -> None:
    assert chain(2).joint_named("j1").between == ("m0", "m1")
    with pytest.raises(ModelError, match="no joint 'j2'; joints: j0, j1"):
        chain(2).joint_named("j2")


@pytest.mark.parametrize("number", [-1.0, float("nan"), float("inf")])
def test_impossible_numbers_are_refused(number: float) -> None:
    with pytest.raises(ModelError, match=r"body 'a': mass .* must be finite and positive"):
        Body(name="a", mass=number)
    with pytest.raises(ModelError, match=r"body 'a': inertia .* kg m\^2 must be finite and positive"):
        Body(name="a", mass=number, motion="rotation")
    with pytest.raises(ModelError, match=r"joint 'j': stiffness .* must be finite and not negative"):
        Joint(name="j", between=("ground", "a"), stiffness=number, damping=0.0)
