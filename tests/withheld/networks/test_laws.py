"""Each law against what defines it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni_withheld.networks import laws

WAYS = np.linspace(-2e-3, 2e-3, 41)
SPRINGS = {
    "magnets": (lambda d: laws.magnets(d, 1e4, 5e-3), 1),
    "tangent": (lambda d: laws.tangent(d, 1e4, 5e-3), 1),
    "wires": (lambda d: laws.wires(d, 1e4, 5e-3), 1),
    "arctangent": (lambda d: laws.arctangent(d, 1e4, 1e-3), -1),
    "membrane": (lambda d: laws.membrane(d, 1e4, 1e-3), -1),
}


@pytest.mark.parametrize("name", SPRINGS)
def test_a_spring_beside_the_joints_is_odd_without_slope_at_rest_and_bends_to_its_side(name):
    force, side = SPRINGS[name]
    forces = np.array([force(d) for d in WAYS])
    assert_allclose(forces, -forces[::-1], atol=1e-9)
    assert abs(force(1e-9)) < 1e-9 * 1e4 * 1e-3
    outer = forces[WAYS > 5e-4]
    assert np.all(side * outer > 0)
    # Stiffer (or softer) the farther out: the slope goes on growing (or falling).
    assert np.all(side * np.diff(outer) > 0)


def test_the_softening_springs_leave_a_whole_spring_rising_to_its_limit():
    assert laws.membrane(1.0, 1e4, 1e-3) + 1e4 == pytest.approx(1e4 * 1e-3, rel=1e-3)
    assert laws.arctangent(1.0, 1e4, 1e-3) + 1e4 == pytest.approx(1e4 * 1e-3 * np.pi / 2, rel=1e-3)


def test_an_orifice_is_quadratic_far_above_and_viscous_far_below_its_laminar_speed():
    assert laws.turbulent(-3.0, 50.0, 0.01) == pytest.approx(-50 * 9, rel=1e-4)
    assert laws.turbulent(1e-4, 50.0, 0.01) == pytest.approx(50 * 0.01 * 1e-4, rel=1e-3)


def test_a_film_damps_with_the_square_of_the_way():
    assert laws.film(2e-3, 0.3, 5.0, 1e-3) == pytest.approx(4 * 5.0 * 0.3)
    assert laws.film(0.0, 0.3, 5.0, 1e-3) == 0


def test_a_spring_with_play_carries_nothing_in_the_gap_and_its_stiffness_outside():
    def whole(d):
        return 1e4 * d + laws.play(d, 1e4, 2e-3, 2e-5)

    assert abs(whole(4e-4)) < 0.01 * 1e4 * 4e-4
    assert whole(6e-3) - whole(5e-3) == pytest.approx(10.0, rel=1e-3)
    assert whole(5e-3) == pytest.approx(1e4 * 4e-3, rel=1e-3)
    assert whole(-5e-3) == pytest.approx(-whole(5e-3))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_hertz_contact_begins_at_its_clearance_and_grows_with_the_power_of_three_halves(side):
    def force(depth, s=0.0):
        return laws.hertz(side * (1e-3 + depth), side * s, 1e6, 1e-3, 0.4, side)

    assert force(-1e-6) == 0
    assert laws.hertz(-side * 5e-3, 0.0, 1e6, 1e-3, 0.4, side) == 0
    assert force(4e-4) / force(1e-4) == pytest.approx(8.0)
    assert side * force(1e-4) > 0
    # Hunt and Crossley: more while it is pressed in than while it comes back, and it never pulls.
    assert force(1e-4, 0.5) / force(1e-4) == pytest.approx(1 + 0.4 * 0.5)
    assert force(1e-4, -10.0) == 0


def test_a_ball_bounces_with_the_restitution_that_hunt_and_crossley_give():
    """For small losses the restitution is 1 - (2/3) dissipation times speed."""
    speed, dissipation, step_s = 0.1, 0.6, 1e-6
    d, s = 0.0, speed
    while d >= 0:
        for _ in range(50):
            half = s - 0.5 * step_s * laws.hertz(d, s, 1e6, 0.0, dissipation, 1.0)
            d += step_s * half
            s = half - 0.5 * step_s * laws.hertz(d, half, 1e6, 0.0, dissipation, 1.0)
    assert -s / speed == pytest.approx(1 - 2 / 3 * dissipation * speed, abs=2e-3)


def test_a_bumper_is_linear_beyond_its_clearance_and_never_pulls():
    assert laws.bumper(3e-3, 0.0, 1e4, 1e-3, 5.0, 1.0) == pytest.approx(20.0)
    assert laws.bumper(3e-3, 0.2, 1e4, 1e-3, 5.0, 1.0) == pytest.approx(21.0)
    assert laws.bumper(1.1e-3, -10.0, 1e4, 1e-3, 5.0, 1.0) == 0
    assert laws.bumper(0.9e-3, 1.0, 1e4, 1e-3, 5.0, 1.0) == 0


def test_cogging_repeats_after_a_period_and_is_nothing_at_rest():
    forces = [laws.cogging(d, 2.0, 1e-3, 0.7) for d in (3e-4, 1.3e-3, -0.7e-3)]
    assert_allclose(forces, forces[0])
    assert laws.cogging(0.0, 2.0, 1e-3, 0.7) == pytest.approx(0)


def test_a_spring_at_an_angle_is_the_slope_of_its_energy_and_not_odd():
    stiffness, length, angle = 1e4, 2e-2, 1.0

    def energy(d):
        now = np.hypot(length * np.cos(angle) + d, length * np.sin(angle))
        return 0.5 * stiffness * (now - length) ** 2

    for d in (-5e-3, 2e-3, 6e-3):
        slope = (energy(d + 1e-7) - energy(d - 1e-7)) / 2e-7
        own = laws.inclined(d, stiffness, length, angle) + stiffness * np.cos(angle) ** 2 * d
        assert own == pytest.approx(slope, rel=1e-6)
    even = laws.inclined(4e-3, stiffness, length, angle) + laws.inclined(-4e-3, stiffness, length, angle)
    assert abs(even) > 0.5 * abs(laws.inclined(4e-3, stiffness, length, angle))


def test_what_changes_begins_at_its_time_and_ends_where_it_should():
    warm, crack, creep = 0.0, 1.0, 2.0
    assert laws.changing(1.0, 0.9, 5.0, warm, 1.0, 2.0) == 0
    assert laws.changing(1.0, 3.0, 5.0, warm, 1.0, 2.0) == pytest.approx(5 * (1 - np.exp(-1)))
    assert laws.changing(1.0, 0.9, 5.0, crack, 1.0, 0.01) == pytest.approx(0, abs=1e-6)
    assert laws.changing(1.0, 1.1, 5.0, crack, 1.0, 0.01) == pytest.approx(5, abs=1e-6)
    assert laws.changing(1.0, 1.0 + 2.0 * (np.e - 1), 5.0, creep, 1.0, 2.0) == pytest.approx(5.0)


def bent(speed, seconds=1.0, step_s=1e-5, numbers=(1e5, 3.0, 2.0, 0.02)):
    """Force of LuGre's bristles after sliding at a speed."""
    stiffness, sliding, rise, fading = numbers
    bend = 0.0
    for _ in range(round(seconds / step_s)):
        bend += step_s * laws.bristle_rate(speed, bend, stiffness, laws.bristle_limit(speed, sliding, rise, fading))
    return stiffness * bend


def test_bristles_slide_with_stribecks_force_against_the_motion():
    assert bent(0.02, 0.1) == pytest.approx(3.0 + 2.0 / 2, rel=1e-3)
    assert bent(0.5, 0.01) == pytest.approx(3.0 + 2.0 / 626, rel=1e-3)
    assert bent(-0.02, 0.1) == pytest.approx(-4.0, rel=1e-3)


def test_bristles_are_a_spring_before_they_slide():
    assert bent(1e-4, 1e-2) == pytest.approx(1e5 * 1e-6, rel=0.05)


def along(path, stiffnesses, yields):
    """Force of sliders along a path, in small steps."""
    stretched, moved = np.zeros(laws.SLIDERS + 1), np.zeros(laws.SLIDERS)
    all_stiffnesses, all_yields = np.zeros(laws.SLIDERS), np.zeros(laws.SLIDERS)
    all_stiffnesses[: len(yields)], all_yields[: len(yields)] = stiffnesses, yields
    forces = []
    for way in np.diff(path, prepend=0.0):
        forces.append(laws.slider_forces(way, stretched, all_stiffnesses, all_yields, moved)[0])
        stretched[: laws.SLIDERS] = moved
    return np.array(forces)


def test_sliders_follow_masings_rule():
    """Back from a turning point the curve is the first one, twice as large both ways."""
    stiffnesses, yields = np.array([1e4, 2e4, 1.5e4]), np.array([2e-4, 5e-4, 9e-4])
    up = np.linspace(0, 1.2e-3, 601)
    first = along(up, stiffnesses, yields)
    there_and_back = along(np.concatenate([up, up[::-1][1:], -up[1:]]), stiffnesses, yields)
    back = there_and_back[600:]
    assert_allclose(back, first[-1] - 2 * np.interp(np.arange(len(back)) / 2, np.arange(601), first), atol=1e-6)
    # Closed after a whole round.
    round_trip = np.concatenate([up, up[::-1][1:], -up[1:], -up[::-1][1:], up[1:]])
    assert along(round_trip, stiffnesses, yields)[-1] == pytest.approx(first[-1])


def test_sliders_end_at_the_sum_of_their_forces_in_one_step_or_many():
    stiffnesses, yields = np.array([1e4, 2e4]), np.array([2e-4, 5e-4])
    whole = float(stiffnesses @ yields)
    assert along(np.array([1e-2]), stiffnesses, yields)[-1] == pytest.approx(whole)
    assert along(np.linspace(0, 1e-2, 999), stiffnesses, yields)[-1] == pytest.approx(whole)


def test_a_relaxing_spring_has_maxwells_complex_stiffness():
    stiffness, time_s, omega, step_s = 3e3, 0.02, 60.0, 1e-5
    times_s = np.arange(0, 1, step_s)
    bend, forces = 0.0, []
    for t in times_s:
        force, rate, _ = laws.element_force(
            laws.RELAXATION, 0.0, omega * np.cos(omega * (t + step_s / 2)), t,
            np.array([stiffness, time_s] + [0.0] * 18), bend, np.zeros(9), np.zeros(8),
        )  # fmt: skip
        forces.append(force)
        bend += step_s * rate
    tail = times_s > 1 - 2 * np.pi / omega * 4
    carrier = np.exp(-1j * omega * times_s[tail])
    found = 2j * np.mean(np.array(forces)[tail] * carrier)
    turn = 1j * omega * time_s
    assert found == pytest.approx(stiffness * turn / (1 + turn), rel=5e-3)
