"""What tuning leaves of a change, and whether a hidden law does what its word means."""

from dataclasses import replace

import numpy as np
import pytest

from chladni_withheld.chains.benches import draw_structure
from chladni_withheld.chains.cases import Order, draw_case
from chladni_withheld.chains.excitations import SensorNoise, draw_drive
from chladni_withheld.chains.plan import Hidden
from chladni_withheld.chains.severity import all_act, left_after_tuning
from chladni_withheld.chains.simulation import measured, perform, rms


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(8)
    bench = replace(draw_structure(rng, "grounded"), samples=4000)
    drive = draw_drive(rng, bench)
    numbers = dict(bench.plan.numbers)
    clean = perform(bench, numbers, drive)
    noise = {name: SensorNoise(share=0.01) for name in measured(bench)}
    return bench, numbers, drive, clean, noise


def left(scene, change, *beside):
    bench, numbers, drive, clean, noise = scene
    return left_after_tuning(bench, numbers, drive, change, clean, noise, beside=beside)


def moved(scene, sigmas):
    """Change of the outputs when the first joint's stiffness moves by so many sigma."""
    bench, numbers, drive, clean, _ = scene
    name = "joint1.stiffness"
    value = numbers[name] * (1 + sigmas * bench.plan.tolerance[name])
    after = perform(bench, {**numbers, name: value}, drive)
    return {each: after[each] - clean[each] for each in measured(bench)}


def size(scene, change):
    _, _, _, clean, noise = scene
    return float(
        np.sqrt(np.mean([(rms(change[name]) / (noise[name].share * rms(clean[name]))) ** 2 for name in noise]))
    )


def test_a_number_inside_its_tolerance_is_tuned_away(scene):
    change = moved(scene, 0.3)
    assert size(scene, change) > 1
    assert left(scene, change) < 0.02 * size(scene, change)


def test_a_number_far_beyond_its_tolerance_is_not(scene):
    near, far = moved(scene, 3.0), moved(scene, 8.0)
    assert left(scene, far) > 0.3 * (size(scene, far) - size(scene, near))


def test_what_no_number_imitates_stays(scene):
    _, _, _, clean, noise = scene
    rng = np.random.default_rng(0)
    change = {
        name: noise[name].share * rms(clean[name]) * 5 * rng.standard_normal(row.size)
        for name, row in clean.items()
        if name in noise
    }
    # A dozen numbers fit a dozen of thousands of random samples.
    assert left(scene, change) == pytest.approx(5.0, rel=0.05)


@pytest.mark.nightly
def test_what_more_of_another_effect_does_is_imitated_by_it(scene):
    bench, numbers, drive, _, noise = scene
    # One number of the machine's is enough beside that of the other effect.
    tolerance = {name: 0.1 if name == "joint1.damping" else 0.0 for name in bench.plan.tolerance}
    bench = replace(bench, plan=replace(bench.plan, tolerance=tolerance))
    speed = rms(perform(bench, numbers, drive, watched=True)["joint1.s"])
    drag = Hidden(
        effect="quadratic_damping", site="joint1", law="quadratic",
        numbers={"coefficient": numbers["joint1.damping"] / speed, "laminar_speed": 0.0},
    )  # fmt: skip
    larger = replace(drag, numbers={**drag.numbers, "coefficient": 1.4 * drag.numbers["coefficient"]})
    there, more = (perform(bench, numbers, drive, (one,), steps=32) for one in (drag, larger))
    change = {name: more[name] - there[name] for name in noise}
    scene = bench, numbers, drive, there, noise
    assert size(scene, change) > 1
    assert left(scene, change, drag) < 0.02 * size(scene, change)


#: So weak that it moves nothing.
RIPPLE = {
    "amplitude": 1e-9, "phase": 0.3, "second": 0.0, "second_phase": 0.0, "third": 0.0, "third_phase": 0.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def case():
    # Its log is among the shortest.
    return draw_case(Order(kind="effect", words=("hysteresis",)), np.random.default_rng(7))


@pytest.mark.nightly
@pytest.mark.parametrize(("share", "opens"), [(0.5, True), (1.5, True), (2.5, False), (20.0, False)])
def test_a_loop_opens_where_half_of_its_yield_is_moved(case, share, opens):
    (loop,) = case.effects
    way = perform(case.bench, case.numbers, case.drive, watched=True)[f"{loop.site}.d"]
    # So weak that it doesn't hold the joint back.
    weak = replace(loop, numbers={**loop.numbers, "force": 1e-9, "yield": share * 0.5 * np.ptp(way)})
    assert all_act(case.bench, case.numbers, case.drive, (weak,)) == opens


@pytest.mark.parametrize("place", ["joint", "input"])
@pytest.mark.parametrize(("periods", "repeats"), [(1.9, False), (2.1, True)])
def test_a_ripple_repeats_from_two_periods_on(case, place, periods, repeats):
    plan = case.bench.plan
    site, signal = (plan.joints[0].name, "d") if place == "joint" else (plan.inputs[0].name, "x")
    way = np.ptp(perform(case.bench, case.numbers, case.drive, watched=True)[f"{site}.{signal}"])
    ripple = Hidden(effect="ripple", site=site, law="ripple", numbers={**RIPPLE, "period": way / periods})
    assert all_act(case.bench, case.numbers, case.drive, (ripple,)) == repeats


def test_what_is_no_loop_needn_t_open(case):
    assert all_act(case.bench, case.numbers, case.drive, ())
