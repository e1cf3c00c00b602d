from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni_withheld.campaign import counts_of
from chladni_withheld.chains import cases
from chladni_withheld.chains.benches import draw_drive_bench, draw_numbers, draw_structure
from chladni_withheld.chains.cases import DEFAULT, Order, draw_case, orders
from chladni_withheld.chains.effects import NEED_A_SPRING
from chladni_withheld.chains.excitations import BEYOND, SensorNoise, draw_drive, draw_noise
from chladni_withheld.chains.scene import Scene
from chladni_withheld.chains.severity import converted
from chladni_withheld.chains.simulation import measured, perform, pooled_change, rms
from chladni_withheld.chains.sites import DRAWN, OUTSIDE_DRAWN, draw_draft

#: In a joint, with a state of its own, on a body, at the input, at a sensor, under the machine.
ONE_OF_EACH_KIND = {
    "coulomb_friction",
    "hysteresis",
    "extra_mode",
    "saturation",
    "mounting_resonance",
    "base_vibration",
}


@pytest.fixture
def short(monkeypatch):
    """Logs of 2000 samples, where a claim is about effects and not about the length of a log."""
    whole = cases._draw_bench
    monkeypatch.setattr(cases, "_draw_bench", lambda rng: replace(whole(rng), samples=2000))


def test_the_default_campaign_asks_for_everything():
    made = orders(counts_of(200, DEFAULT), np.random.default_rng(1))
    assert Counter(order.kind for order in made) == {kind: share for kind, share in DEFAULT.items() if share}
    words = Counter(word for order in made if order.kind == "effect" for word in order.words)
    assert set(words) == set(DRAWN)
    assert min(words.values()) >= 3
    quiet = [order for order in made if order.kind in ("none", "parameters")]
    assert len(quiet) >= 60
    assert abs(sum(order.coloured for order in quiet) - len(quiet) / 2) <= 1
    for order in made:
        assert (order.kind == "leave_out") == (bool(order.words) and set(order.words) <= set(order.leave_out))
    # Words are left out in ordinary cases too, so that a list says nothing.
    assert sum(bool(order.leave_out) for order in made if order.kind == "none") > 5
    assert len([order for order in made if order.kind == "two" and len(order.words) == 2]) == DEFAULT["two"]


def scene_for(word, footing):
    """A bench on which the word has a site, what drives it, and its draft."""
    rng = np.random.default_rng([3, len(word)])
    for _ in range(40):
        bench = draw_drive_bench(rng) if footing == "drive" else draw_structure(rng, footing)
        bench = replace(bench, samples=2000 if footing == "drive" else 500)
        drive = draw_drive(rng, bench)
        numbers = draw_numbers(rng, bench.plan)
        clean = perform(bench, numbers, drive, watched=True)
        scene = Scene(bench=bench, numbers=numbers, rng=rng, moving={name: rms(row) for name, row in clean.items()})
        draft = draw_draft(scene, word)
        if draft is not None:
            return scene, drive, clean, draft
    return None


@pytest.mark.parametrize(
    "footing", ["grounded", *(pytest.param(one, marks=pytest.mark.nightly) for one in ("loop", "drive"))]
)
@pytest.mark.parametrize(
    "word",
    [
        word if word in ONE_OF_EACH_KIND else pytest.param(word, marks=pytest.mark.nightly)
        for word in (*DRAWN, *OUTSIDE_DRAWN)
    ],
)
def test_every_draft_moves_the_outputs_the_more_the_larger(word, footing):
    found = scene_for(word, footing)
    if found is None:
        # Only what needs springs, a ground or two equal sensors has no place in a drive.
        assert footing == "drive"
        assert word in NEED_A_SPRING | {"base_vibration", "cross_axis"} | set(OUTSIDE_DRAWN)
        return
    scene, drive, clean, draft = found
    bench, names = scene.bench, measured(scene.bench)
    assert drive.signals.shape[1] == drive.before + bench.samples + BEYOND

    def change(size):
        hidden = draft.hidden(size)
        assert hidden.effect == word
        moved = perform(bench, scene.numbers, drive, [hidden], steps=64)
        return pooled_change(bench, {name: clean[name] for name in names}, converted(moved, (hidden,), names))

    # Limits of size one are at four times the RMS, which a sweep never reaches.
    middle = min(max(3.5 if word in ("clipping", "saturation") else 1.0, draft.least), draft.most)
    assert change(middle) > 1e-6
    small = max(0.3 * middle, draft.least)
    if small < 0.9 * middle and word != "held_samples":
        assert change(small) < 1.02 * change(middle)


@pytest.mark.nightly
@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("kind", ["effect", "faint"])
def test_an_effect_has_the_severity_that_was_asked_for(kind):
    case = draw_case(Order(kind=kind, words=("coulomb_friction",)), np.random.default_rng(2))
    low, high = (3.0, 1 / case.noise_share) if kind == "effect" else (0.3, 3.0)
    assert low <= case.ratio <= high
    names = measured(case.bench)
    still = perform(case.bench, case.numbers, case.drive)
    # What the truth says is what the log's clean signals show.
    assert case.ratio * case.noise_share == pytest.approx(pooled_change(case.bench, still, case.clean), rel=1e-9)
    for name in names:
        noise = case.recorded[name] - case.clean[name]
        assert rms(noise) == pytest.approx(case.noise[name].share * rms(case.clean[name]), rel=1e-9)
    if kind == "effect":
        assert case.ratio_tuned >= 1.0


@pytest.mark.usefixtures("short")
@pytest.mark.nightly
def test_a_case_with_two_effects_has_both_at_different_sites():
    case = draw_case(Order(kind="two", words=("quadratic_damping", "gain_error")), np.random.default_rng(7))
    assert [one.effect for one in case.effects] == ["quadratic_damping", "gain_error"]
    assert len({one.site for one in case.effects}) == 2
    assert min(case.ratios) >= 2.8
    # Neither the tolerances of the model nor a larger other effect may imitate one of them.
    assert len(case.ratios_tuned) == 2
    assert min(case.ratios_tuned) >= 1.0


@pytest.mark.usefixtures("short")
@pytest.mark.nightly
def test_a_case_with_three_effects_has_each_at_its_own_site():
    made = orders({"three": 30}, np.random.default_rng(1))
    assert all(len(order.words) == 3 for order in made)
    case = draw_case(Order(kind="three", words=("delay", "gain_error", "added_mass")),
                     np.random.default_rng(7))  # fmt: skip
    assert [one.effect for one in case.effects] == ["delay", "gain_error", "added_mass"]
    assert len({one.site for one in case.effects}) == 3
    assert len(case.ratios_tuned) == 3
    assert min(case.ratios_tuned) >= 1.0


@pytest.mark.nightly
@pytest.mark.usefixtures("short")
@pytest.mark.parametrize(
    ("rule", "refused", "accepted"),
    [("_left_beside", 0.9, 1.1), ("all_act", False, True)],
    ids=["a half that the other imitates", "a law that does nothing of its own"],
)
def test_what_a_rule_refuses_is_drawn_again(rule, refused, accepted, monkeypatch):
    asked = []

    def ruled(bench, *_, **__):
        asked.append(bench)
        return refused if bench is asked[0] else accepted

    monkeypatch.setattr(cases, "_left_beside", lambda *_: 1.1)
    monkeypatch.setattr(cases, rule, ruled)
    order = Order(kind="two", words=("hysteresis", "gain_error"))
    case = draw_case(order, np.random.default_rng(7))
    assert case.bench is not asked[0]
    assert any(case.bench is one for one in asked[1:])


@pytest.mark.parametrize("colour", ["white", "pink", "low_pass", "resonant"])
def test_noise_has_unit_size_and_its_colour(colour):
    noise = SensorNoise(share=0.01, colour=colour, corner=0.1).samples(1 << 16, np.random.default_rng(0))
    assert rms(noise) == pytest.approx(1.0)
    power = np.abs(np.fft.rfft(noise)) ** 2
    share = np.fft.rfftfreq(noise.size)

    def level(low, high):
        return float(np.mean(power[(share > low) & (share < high)]))

    # Bands hold hundreds of lines: their mean power is known to a tenth.
    low, middle, high = level(0.004, 0.02), level(0.09, 0.11), level(0.4, 0.5)
    expected = {
        "white": (1.0, 1.0), "pink": (0.09, 0.021), "low_pass": (0.5, 0.047), "resonant": (17.0, 0.085),
    }[colour]  # fmt: skip
    assert_allclose((middle / low, high / low), expected, rtol=0.3)


def test_noise_differs_between_channels():
    rng = np.random.default_rng(1)
    drawn = [draw_noise(rng, coloured=True) for _ in range(200)]
    assert min(one.share for one in drawn) >= 0.003
    assert max(one.share for one in drawn) <= 0.03
    assert {one.colour for one in drawn} == {"pink", "low_pass", "resonant"}
    assert {draw_noise(rng, coloured=False).colour for _ in range(10)} == {"white"}
