"""What decides whether a case is fair, against machines whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni_withheld.networks import laws
from chladni_withheld.networks.excitation import Band, Signal, draw_signal
from chladni_withheld.networks.linear_view import LinearView
from chladni_withheld.networks.machine import Addition, Element, Link, Recorder, record
from chladni_withheld.networks.network import Joint
from chladni_withheld.networks.rivals import Rivals
from chladni_withheld.networks.severity import Yardstick, port_directions
from tests.withheld.networks.machines import grid, two_bodies

AT = grid(samples=3000, before=1500)


def driven(hold="band_limited", network=None, seed=0):
    network = network or two_bodies()
    band = Band(low_hz=5.0, high_hz=90.0)
    signal, _ = draw_signal(np.random.default_rng(seed), AT, band, hold, from_rest=seed % 2 == 0)
    return LinearView(network=network, grid=AT, drives=(Signal(values=20 * signal.values, jumps=signal.jumps),))


def measure_of(view, tolerance=0.03, noise=0.01):
    outputs = np.sqrt(np.mean(view.log() ** 2, axis=1))
    steps = {name: tolerance * value for name, value in view.network.numbers().items()}
    return Yardstick(view=view, steps=steps, outputs=outputs, noise=noise * outputs)


@pytest.mark.parametrize("hold", ["band_limited", "zoh"])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_linear_view_gives_the_integrators_log(hold, seed):
    view = driven(hold, seed=seed)
    recording = record(view.network, (), view.drives, Recorder(grid=AT))
    size = np.sqrt(np.mean(recording.outputs**2, axis=1))
    error = np.sqrt(np.mean((view.log() - recording.outputs) ** 2, axis=1))
    # A held force's images beyond 1.5 of the rate are left out.
    assert np.all(error < (5e-5 if hold == "band_limited" else 3e-3) * size)


@pytest.mark.parametrize("hold", ["band_limited", "zoh"])
def test_its_derivatives_are_those_of_finite_differences(hold):
    view = driven(hold)
    names = list(view.network.numbers())
    for name, change in zip(names, view.by_numbers(names), strict=True):
        value = view.network.numbers()[name]
        logs = [
            replace(view, network=view.network.with_numbers({name: value * factor})).log()
            for factor in (1.0001, 0.9999)
        ]
        difference = (logs[0] - logs[1]) / (2e-4 * value)
        size = np.sqrt(np.mean(difference**2, axis=1))
        # Derivatives leave out a held force's images above half the rate.
        assert np.all(
            np.sqrt(np.mean((change - difference) ** 2, axis=1)) < (1e-3 if hold == "band_limited" else 0.1) * size
        )


def test_a_ratio_is_the_pooled_change_over_the_pooled_noise():
    view = driven()
    measure = measure_of(view, noise=0.02)
    assert measure.share == pytest.approx(0.02)
    assert measure.ratio(0.1 * view.log()) == pytest.approx(0.1 / 0.02)


def test_tuning_takes_up_wrong_numbers_however_far_resonances_go():
    view = driven()
    off = view.network.with_numbers({"mount.stiffness": 1.09 * 9e4, "head.mass": 0.97 * 1.2})
    change = replace(view, network=off).log() - view.log()
    measure = measure_of(view)
    tuned = measure.tuned(change)
    assert measure.ratio(change) > 30
    assert measure.ratio(tuned.left) < 0.1
    assert tuned.numbers["mount.stiffness"] == pytest.approx(1.09 * 9e4, rel=5e-3)


def test_tuning_within_tolerances_leaves_what_is_beyond_them():
    view = driven()
    change = replace(view, network=view.network.with_numbers({"head.mass": 1.1 * 1.2})).log() - view.log()
    measure = measure_of(view, tolerance=0.01)
    bounded = measure.tuned(change, within=3.0)
    assert measure.ratio(bounded.left) > 5
    assert bounded.numbers["head.mass"] <= 1.0301 * 1.2
    assert measure.ratio(measure.tuned(change).left) < 3


def test_tuning_pays_for_what_it_moves_and_leaves_what_no_number_does():
    view = driven()
    measure = measure_of(view)
    still = measure.tuned(0 * view.log())
    assert still.numbers == pytest.approx(view.network.numbers())
    assert still.cost == pytest.approx(0, abs=1e-9)
    element = Element(code=laws.WIRES, first=0, second=1, numbers=(4e5, 8e-4), joint=1)
    change = change_by(view, element)
    assert 3 < measure.ratio(measure.tuned(change).left) < 0.9 * measure.ratio(change)


def change_by(view, element):
    recorder = Recorder(grid=AT)
    with_it = record(view.network, (Addition(elements=(element,)),), view.drives, recorder).outputs
    return with_it - record(view.network, (), view.drives, recorder).outputs


def test_any_force_at_the_place_explains_a_hidden_law_and_none_elsewhere():
    view = driven()
    element = Element(code=laws.WIRES, first=0, second=1, numbers=(4e5, 8e-4), joint=1)
    change = change_by(view, element)
    measure = measure_of(view)
    directions = port_directions(view)
    left = dict(zip(directions, measure.elsewhere(change, list(directions.values())), strict=True))
    # The window leaves about the time constant of the slowest mode over the log's length.
    assert left["bush"] < 0.08 * measure.ratio(change)
    assert all(left[name] > 0.2 * measure.ratio(change) for name in ("mount", "strut", "frame", "head"))


def rivals_of(base, true, steps=None):
    lines = base.below_half
    measure = measure_of(true)
    return Rivals(
        base=base, truth=true.outputs[:, :lines] - base.outputs[:, :lines], steps=steps or measure_of(base).steps,
        weights=measure.weights, ratio=measure.ratio(true.log() - base.log()),
    )  # fmt: skip


def without_strut():
    whole = two_bodies()
    return replace(whole, joints=whole.joints[:2])


def test_a_missing_link_is_the_joint_that_it_is():
    """A network whose joint is left out: its link is named, at its size, and leaves nothing."""
    true, base = driven(), driven(network=without_strut())
    base = replace(base, pause=true.dying)
    true = replace(true, pause=true.dying)
    rivals = rivals_of(base, true)
    (link,) = [change for change in rivals.changes() if change.kind == "link"]
    assert link.name == "ground~head"
    assert rivals.left(link, (np.log(2e4), np.log(3.0))) < 1e-3 * rivals.ratio
    left, name = rivals.nearest(frozenset())
    assert name == "ground~head"
    assert left < 0.02 * rivals.ratio
    assert rivals.nearest(frozenset({"ground~head"}))[0] > 3.0


@pytest.mark.parametrize("name", ["mount.stiffness", "bush.damping", "head.mass"])
def test_a_wrong_number_is_the_change_that_it_is(name):
    true = driven()
    wrong = {name: 5 * true.network.numbers()[name]}
    base = replace(true, network=true.network.with_numbers(wrong))
    pause = max(true.dying, base.dying)
    true, base = replace(true, pause=pause), replace(base, pause=pause)
    rivals = rivals_of(base, true)
    assert rivals.nearest(frozenset()) == (pytest.approx(0, abs=0.02 * rivals.ratio), name)
    (change,) = [change for change in rivals.changes() if change.name == name]
    assert rivals.left(change, (-np.log(5),)) < 1e-3 * rivals.ratio


def test_a_link_of_a_mass_or_a_shaken_ground_is_reckoned_too():
    """The change of a mass under a shaken ground resists its motion in space."""
    from chladni_withheld.networks.network import GROUND, Drive

    network = two_bodies(drives=(Drive(name="floor", where="ground", at=GROUND),))
    true = driven(network=network)
    base = replace(true, network=network.with_numbers({"head.mass": 2.4}))
    pause = max(true.dying, base.dying)
    true, base = replace(true, pause=pause), replace(base, pause=pause)
    rivals = rivals_of(base, true)
    (change,) = [change for change in rivals.changes() if change.name == "head.mass"]
    assert rivals.left(change, (-np.log(2),)) < 1e-3 * rivals.ratio


def test_links_by_addition_and_by_joint_move_alike():
    view = driven(network=without_strut())
    link = Addition(links=(Link(first=-1, second=1, stiffness=2e4, damping=3.0),))
    joint = Joint(name="more", first=-1, second=1, stiffness=2e4, damping=3.0)
    longer = replace(view.network, joints=(*view.network.joints, joint))
    recorder = Recorder(grid=AT)
    assert_allclose(
        record(view.network, (link,), view.drives, recorder).outputs,
        record(longer, (), view.drives, recorder).outputs,
        rtol=1e-9, atol=1e-12,
    )  # fmt: skip
