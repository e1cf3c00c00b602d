"""Cases of all kinds: that they are made, that users' commands take them, and that their truths hold."""

import functools
import json
import subprocess
import sys
from typing import get_args

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.signal import StateSpace, cont2discrete, lsim, resample

import chladni
from chladni_withheld.campaign import make_cases
from chladni_withheld.case import PARAMETER, Kind
from chladni_withheld.folders import case_folders, truth_of_case
from chladni_withheld.networks.draw import DEFAULT, draw_case
from chladni_withheld.networks.hiding import DRAFTS, OUTSIDE_DRAFTS, RefusedError
from chladni_withheld.networks.plots import with_word
from chladni_withheld.vocabulary import OUTSIDE, WORDS

KINDS = tuple(DEFAULT)
# What a kind hides is in its truth; users' files differ by what is connected and by what is stated wrongly.
BY_DAY = ("none", "effect", "topology")
EACH_KIND = [kind if kind in BY_DAY else pytest.param(kind, marks=pytest.mark.nightly) for kind in KINDS]
SEED = 35


def test_all_words_and_kinds_can_be_drawn_and_what_is_outside_is_known_to_the_score():
    assert set(DRAFTS) == set(WORDS)
    assert set(KINDS) <= set(get_args(Kind))
    assert set(OUTSIDE_DRAFTS) <= set(OUTSIDE)


@functools.cache
def drawn(kind):
    """Give the case of a kind; each process draws those alone that it's asked for."""
    return draw_case(SEED, KINDS.index(kind) + 1, kind)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    directory = tmp_path_factory.mktemp("networks")
    make_cases(directory, count=1, seed=SEED, generator="networks", kinds=["value=1"])
    return directory


@pytest.mark.nightly
def test_users_load_cases(campaign):
    for case in case_folders(campaign):
        model = chladni.load_model(campaign / "cases" / case.name / "model.toml")
        log = chladni.open_log(campaign / "cases" / case.name / "log.mcap")
        ports = [*model.inputs, *model.outputs]
        assert {channel.name for channel in log.channels} == {port.channel for port in ports}
        units = {channel.name: channel.unit for channel in log.channels}
        assert "1" not in units.values()
        truth = truth_of_case(campaign, case)
        assert set(truth["off"]) <= set(model.parameters)


@pytest.mark.nightly
def test_the_command_reads_a_log_of_this_kind(campaign):
    log = case_folders(campaign)[0].log
    done = subprocess.run([sys.executable, "-m", "chladni", "info", str(log), "--json", "-"], capture_output=True)
    told = json.loads(done.stdout)
    assert done.returncode == 0
    assert not told["damage"]
    assert {channel["jitter_s"] for channel in told["channels"]} == {0.0}


@pytest.mark.nightly
@pytest.mark.parametrize(
    "kind", [kind if kind == "none" else pytest.param(kind, marks=pytest.mark.nightly) for kind in KINDS]
)
def test_the_same_three_give_the_same_case(kind):
    index = KINDS.index(kind) + 1
    again = draw_case(SEED, index, kind)
    case = drawn(kind)
    assert again.model == case.model
    for one, other in zip(again.channels, case.channels, strict=True):
        assert_array_equal(one.samples, other.samples)
    assert json.dumps(dict(again.further)) == json.dumps(dict(case.further))
    assert again.effects == case.effects


@pytest.mark.nightly
def test_other_indices_and_seeds_give_other_cases():
    case = drawn("none")
    for other in (draw_case(SEED, 99, "none"), draw_case(SEED + 1, KINDS.index("none") + 1, "none")):
        assert other.model != case.model


def stated(case, tmp_path):
    """Numbers that a case's model file states, and their tolerances."""
    path = tmp_path / "model.toml"
    path.write_text(case.model)
    model = chladni.load_model(path)
    return {name: (parameter.value, parameter.tolerance) for name, parameter in model.parameters.items()}


@pytest.mark.nightly
@pytest.mark.parametrize("kind", EACH_KIND)
def test_numbers_are_inside_their_tolerances_but_those_that_are_told(kind, tmp_path):
    case = drawn(kind)
    numbers = stated(case, tmp_path)
    assert set(case.parameters) == {name for name, (value, _) in numbers.items() if value}
    for name, true in case.parameters.items():
        value, tolerance = numbers[name]
        sigma = (true / value - 1) / tolerance
        if name in case.off:
            assert sigma == pytest.approx(case.off[name])
            assert abs(sigma) > 4.999
        else:
            assert abs(sigma) < 2.001


@pytest.mark.parametrize("kind", EACH_KIND)
def test_a_truth_says_what_its_kind_says(kind):
    case = drawn(kind)
    words = [effect.effect for effect in case.effects if effect.effect != PARAMETER]
    wrong = [effect for effect in case.effects if effect.effect == PARAMETER]
    counts = {"none": 0, "parameters": 0, "value": 0, "two": 2, "three": 3}
    assert len(words) == counts.get(kind, 1)
    assert bool(wrong) == (kind in ("value", "value_and_effect"))
    assert bool(case.off) == (kind in ("value", "value_and_effect", "parameters"))
    assert case.leave_out == (tuple(words) if kind == "leave_out" else ())
    assert all(word in (OUTSIDE if kind == "outside" else WORDS) for word in words)
    if kind == "topology":
        assert words == ["missing_link"]
    for effect in case.effects:
        if effect.severity is not None:
            assert 0.1 < effect.severity < 3 if kind == "faint" else effect.severity > 5
        if effect.severity_tuned is not None:
            assert 3 <= effect.severity_tuned <= effect.severity * 1.001


@pytest.mark.nightly
def test_a_clean_logs_noise_is_what_was_asked_for():
    for index in range(1, 5):
        case = draw_case(SEED, index, "none")
        assert case.noise_share == pytest.approx((0.003, 0.01)[index // 2 % 2], rel=1e-3)
        assert case.further["hold"] == ("band_limited", "zoh")[index % 2]
        assert case.ratio is None


def own_state_space(case, tmp_path):
    """State space of a case's machine with its true numbers, made of nothing but its model file."""
    path = tmp_path / "model.toml"
    path.write_text(case.model)
    model = chladni.load_model(path)
    import tomllib

    text = tomllib.loads(case.model)
    bodies = [body["name"] for body in text["body"]]
    word = "inertia" if "inertia" in text["body"][0] else "mass"
    mass = np.diag([case.parameters[f"{body}.{word}"] for body in bodies])
    count = len(bodies)

    def along(ends):
        direction = np.zeros(count)
        for end, sign in zip(ends, (-1, 1), strict=True):
            if end != "ground":
                direction[bodies.index(end)] += sign
        return direction

    joints = {joint["name"]: along(joint["between"]) for joint in text["joint"]}
    damping, stiffness = np.zeros((count, count)), np.zeros((count, count))
    for name, direction in joints.items():
        damping += case.parameters.get(f"{name}.damping", 0.0) * np.outer(direction, direction)
        stiffness += case.parameters.get(f"{name}.stiffness", 0.0) * np.outer(direction, direction)
    columns = []
    for entry in text["input"]:
        if entry.get("kind") == "base_acceleration":
            columns.append(-np.diag(mass))
        else:
            columns.append(joints[entry["joint"]] if "joint" in entry else along(["ground", entry["at"]]))
    inverse, forces = np.linalg.inv(mass), np.array(columns).T
    a = np.block([[np.zeros((count, count)), np.eye(count)], [-inverse @ stiffness, -inverse @ damping]])
    b = np.vstack([np.zeros_like(forces), inverse @ forces])
    c, d = [], []
    for entry in text["output"]:
        direction = joints[entry["joint"]] if "joint" in entry else along(["ground", entry["at"]])
        row, direct = np.zeros(2 * count), np.zeros(len(columns))
        if entry["measures"] == "acceleration":
            row, direct = direction @ a[count:], direction @ b[count:]
            if "at" in entry:
                direct = direct + [one.get("kind") == "base_acceleration" for one in text["input"]]
        elif entry["measures"] == "force":
            name = entry["joint"]
            row[:count] = case.parameters.get(f"{name}.stiffness", 0.0) * direction
            row[count:] = case.parameters.get(f"{name}.damping", 0.0) * direction
        else:
            row[count * (entry["measures"] == "velocity") :][:count] = direction
        c.append(row)
        d.append(direct)
    assert len(model.outputs) == len(c)
    return a, b, np.array(c), np.array(d)


def from_rest(hold, need):
    """Cases with nothing hidden whose machines are at rest before the log."""
    found = []
    for index in range(1, 40):
        case = draw_case(SEED, index, "none")
        if case.further["hold"] == hold and not case.starts_in_motion and not case.further["common_filter"]:
            found.append(case)
        if len(found) == need:
            return found
    raise AssertionError(hold)


def left_over_noise(case, outputs, keep):
    measured = np.array([channel.samples for channel in case.channels if not channel.drives])
    rest = (measured - outputs)[:, keep]
    noise = np.array([entry["rms"] for entry in case.noise.values()])
    return np.sqrt(np.mean(rest**2, axis=1)) / noise


def test_with_true_numbers_a_held_log_leaves_its_noise_alone(tmp_path):
    for case in from_rest("zoh", 2):
        a, b, c, d = own_state_space(case, tmp_path)
        step_a, step_b, *_ = cont2discrete((a, b, c, d), 1 / case.sample_rate_hz)
        inputs = np.array([channel.samples for channel in case.channels if channel.drives]).T
        x = np.zeros((len(inputs), len(a)))
        for number in range(1, len(inputs)):
            x[number] = step_a @ x[number - 1] + step_b @ inputs[number - 1]
        outputs = (x @ c.T + inputs @ d.T).T
        np.testing.assert_allclose(left_over_noise(case, outputs, slice(None)), 1.0, rtol=0.03)


@pytest.mark.nightly
def test_with_true_numbers_a_band_limited_log_leaves_its_noise_alone(tmp_path):
    over = 16
    for case in from_rest("band_limited", 1):
        a, b, c, d = own_state_space(case, tmp_path)
        inputs = np.array([channel.samples for channel in case.channels if channel.drives])
        count = inputs.shape[1]
        # The signal's own mirror image joins its ends, where the transform's period begins anew.
        mirrored = np.concatenate([inputs, inputs[:, ::-1]], axis=1)
        fine = resample(mirrored, 2 * over * count, axis=1)[:, : over * count]
        times_s = np.arange(over * count) / (over * case.sample_rate_hz)
        _, y, _ = lsim(StateSpace(a, b, c, d), fine.T, times_s)
        outputs = np.atleast_2d(y.T)[:, ::over]
        # The join is smooth to the first order only: the last samples tell nothing.
        np.testing.assert_allclose(left_over_noise(case, outputs, slice(0, count * 9 // 10)), 1.0, rtol=0.05)


@pytest.mark.nightly
@pytest.mark.parametrize("word", WORDS)
def test_every_word_makes_a_fair_case(word):
    for rng in np.random.default_rng((SEED, WORDS.index(word))).spawn(60):
        try:
            plot = with_word(rng, word)
        except RefusedError:
            continue
        (hidden,) = plot.hidden
        assert hidden.draft.word == word
        assert hidden.ratio >= 5
        assert hidden.ratio_tuned >= 3
        return
    raise AssertionError(f"{word}: every draw was refused")
