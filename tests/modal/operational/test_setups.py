from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.operational.efdd import EnhancedFrequencyDomainDecomposition
from chladni.modal.operational.setups import merge_setups
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance
from chladni.spectral.cross_spectra import cross_spectra
from tests.modal.truth import MOTION, ambient_record, chain

TRUTH = chain()
ALL = [Channel(name=f"/mass{mass}", unit="m/s^2", point=f"p{mass}", direction=(0.0, 0.0, 1.0)) for mass in range(5)]


def setup(masses, *, modes=range(5), std=0.01, frequency_hz=None, channels=None, turn=1.0, rng=None, **others):
    """What a set-up on some masses sees: shapes scaled to their own largest component, as methods give them."""
    modes = list(modes)
    raw = turn * TRUTH.unit_shapes[np.ix_(modes, list(masses))].astype(complex)
    if rng is not None:
        raw += std / np.sqrt(2) * (rng.standard_normal(raw.shape) + 1j * rng.standard_normal(raw.shape))
    largest = np.argmax(np.abs(raw), axis=1)
    top = raw[np.arange(len(modes)), largest][:, None]
    shapes = raw / top
    # The error of the largest component is in all others.
    spread = std / np.sqrt(2) / np.abs(top) * np.sqrt(1 + np.abs(shapes) ** 2) * (1 + 1j)
    spread[np.arange(len(modes)), largest] = 0
    found = TRUTH.frequency_hz[modes] if frequency_hz is None else np.array(frequency_hz)
    return ModeSet(
        frequency_hz=found,
        frequency_std_hz=np.full(found.size, 1e-3),
        damping_ratio=np.full(found.size, 0.01),
        damping_std=np.full(found.size, 1e-3),
        shapes=shapes,
        shape_std=spread,
        channels=tuple(ALL[mass] for mass in masses) if channels is None else tuple(channels),
        provenance=Provenance(estimator="EFDD", notes=("unscaled",)),
        **others,
    )


def test_exact_parts_give_the_exact_whole():
    merged = merge_setups([setup([0, 1, 2]), setup([0, 4, 2, 3])])
    assert [channel.name for channel in merged.channels] == ["/mass0", "/mass1", "/mass2", "/mass4", "/mass3"]
    np.testing.assert_allclose(merged.shapes, TRUTH.unit_shapes[:, [0, 1, 2, 4, 3]], atol=1e-12)
    np.testing.assert_allclose(merged.frequency_hz, TRUTH.frequency_hz, rtol=1e-12)
    # Two set-ups that agree know the mean better by the root of two.
    np.testing.assert_allclose(merged.frequency_std_hz, 1e-3 / np.sqrt(2))
    np.testing.assert_allclose(merged.damping_std, 1e-3 / np.sqrt(2))
    assert merged.provenance.notes.count("unscaled") == 1
    assert any("set-up 2 is scaled by /mass0, /mass2" in note for note in merged.provenance.notes)


def test_set_ups_may_hang_together_like_a_chain():
    merged = merge_setups([setup([0, 1]), setup([1, 2, 3]), setup([3, 4])])
    np.testing.assert_allclose(merged.shapes, TRUTH.unit_shapes, atol=1e-12)


def test_error_bars_of_merged_shapes_cover_the_truth():
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(120):
        merged = merge_setups([setup([0, 2, 1], rng=rng), setup([2, 3, 0], rng=rng), setup([0, 4, 2], rng=rng)])
        error = merged.shapes - TRUTH.unit_shapes[:, [0, 2, 1, 3, 4]]
        free = merged.shape_std.real > 0
        inside.append(np.abs(error.real[free]) <= 1.96 * merged.shape_std.real[free])
        inside.append(np.abs(error.imag[free]) <= 1.96 * merged.shape_std.imag[free])
    # 4800 numbers, some of which hang together: a percent is four sigma, and first order leaves some of it too.
    assert 0.93 < np.mean(np.concatenate(inside)) < 0.98


def test_a_second_look_at_a_shared_channel_makes_it_better():
    merged = merge_setups([setup([0, 1, 2, 3, 4]), setup([0, 1, 2, 3, 4])])
    alone = setup([0, 1, 2, 3, 4])
    free = alone.shape_std.real > 0
    gained = merged.shape_std.real[free] / alone.shape_std.real[free]
    assert np.all(gained < 0.85)
    assert np.all(gained > 0.65)


def test_records_of_two_set_ups_give_the_shapes_of_the_whole():
    rng = np.random.default_rng(1)
    method = EnhancedFrequencyDomainDecomposition()
    found = []
    for masses in ([0, 1, 4], [4, 2, 3, 0]):
        record = ambient_record(TRUTH, cycles=2000, rng=rng, noise=0.02)
        found.append(method.identify(cross_spectra(record.select([MOTION.format(mass) for mass in masses]))))
    merged = merge_setups(found)
    truth = TRUTH.unit_shapes[:, [0, 1, 4, 2, 3]]
    assert merged.frequency_hz.size == 5
    for shape, exact in zip(merged.shapes, truth, strict=True):
        assert abs(np.vdot(shape, exact)) ** 2 / (np.vdot(shape, shape).real * (exact @ exact)) > 0.99
    assert np.all(np.abs(merged.frequency_hz - TRUTH.frequency_hz) < 4 * merged.frequency_std_hz)


def test_the_same_place_counts_under_another_name_and_turned_round():
    turned = Channel(name="again", unit="m/s^2", point="p2", direction=(0.0, 0.0, -1.0))
    other = setup([2, 3, 4])
    # The sensor at mass 2 hangs upside down.
    flipped = replace(other, shapes=other.shapes * np.array([-1.0, 1.0, 1.0]), channels=(turned, *ALL[3:]))
    merged = merge_setups([setup([0, 1, 2]), flipped])
    assert [channel.name for channel in merged.channels] == [f"/mass{mass}" for mass in range(5)]
    np.testing.assert_allclose(merged.shapes, TRUTH.unit_shapes, atol=1e-12)


def test_references_choose_the_channels_that_scale():
    other = setup([0, 1, 2, 3])
    # Channel 1 of the second set-up was badly glued.
    wrong = replace(other, shapes=other.shapes * np.array([1.0, 0.8, 1.0, 1.0]))
    merged = merge_setups([setup([0, 1, 2, 4]), wrong], references=["/mass0", "/mass2"])
    largest = np.argmax(np.abs(TRUTH.unit_shapes), axis=1) != 1
    # Where channel 1 isn't the largest component, it spoils nothing but itself.
    np.testing.assert_allclose(
        merged.shapes[largest][:, [0, 2, 3, 4]], TRUTH.unit_shapes[largest][:, [0, 2, 4, 3]], atol=1e-12
    )
    spoiled = merge_setups([setup([0, 1, 2, 4]), wrong])
    assert np.abs(spoiled.shapes[largest][:, 4] - TRUTH.unit_shapes[largest][:, 3]).max() > 0.01


def test_one_shared_channel_pairs_by_frequency():
    merged = merge_setups([setup([0, 1, 2]), setup([2, 3, 4], frequency_hz=TRUTH.frequency_hz * 1.005)])
    assert merged.frequency_hz.size == 5
    np.testing.assert_allclose(merged.shapes, TRUTH.unit_shapes, atol=1e-12)


def test_modes_without_a_partner_are_left_out_and_told():
    merged = merge_setups([setup([0, 1, 2]), setup([0, 1, 3], modes=[0, 2, 3]), setup([0, 1, 4], modes=[0, 1, 3, 4])])
    np.testing.assert_allclose(merged.frequency_hz, TRUTH.frequency_hz[[0, 3]])
    notes = " ".join(merged.provenance.notes)
    assert "2.919 Hz is left out: set-up 2 has none like it" in notes
    assert "6.742 Hz is left out: set-up 2 has none like it" in notes
    assert f"{TRUTH.frequency_hz[2]:.4g} Hz is left out: set-up 3 has none like it" in notes
    assert "6.742 Hz of set-up 3 is left out: set-ups before it have none like it" in notes


def test_set_ups_that_disagree_get_wider_error_bars_and_a_word():
    moved = TRUTH.frequency_hz.copy()
    moved[1] *= 1.01
    merged = merge_setups([setup([0, 1, 2]), setup([0, 1, 3], frequency_hz=moved)])
    # Two values 2 d apart have chi^2 = 2 d^2/sigma^2: the mean's sigma/sqrt(2) grows to d.
    assert merged.frequency_std_hz[1] == pytest.approx(0.005 * TRUTH.frequency_hz[1])
    assert merged.frequency_std_hz[0] == pytest.approx(1e-3 / np.sqrt(2))
    told = [note for note in merged.provenance.notes if "differs between set-ups" in note]
    assert len(told) == 1
    assert "natural frequency of the mode at 2.934 Hz" in told[0]


def test_means_without_error_bars_take_the_scatter_between_set_ups():
    one = replace(setup([0, 1, 2]), frequency_std_hz=np.zeros(5), shape_std=np.zeros((5, 3), complex))
    moved = setup([0, 1, 3], frequency_hz=TRUTH.frequency_hz + 0.01)
    merged = merge_setups([one, moved])
    np.testing.assert_allclose(merged.frequency_hz, TRUTH.frequency_hz + 0.005)
    np.testing.assert_allclose(merged.frequency_std_hz, 0.005)


def with_forces(one, references, participation, scale=None):
    names = tuple(Channel(name=name, unit="N", role="reference") for name in references)
    return replace(one, references=names, participation=participation, scale=scale)


def test_modes_of_frequency_responses_keep_their_receptance():
    # psi_i L_j is what a receptance is made of; a hammer at mass 0, accelerometers that rove.
    def part(masses):
        one = setup(masses)
        unit = TRUTH.shapes / (2j * TRUTH.poles.imag[:, None])
        largest = np.array([masses[row] for row in np.argmax(np.abs(one.shapes), axis=1)])
        participation = (TRUTH.shapes[np.arange(5), largest] * unit[:, 0])[:, None]
        modal_a = one.shapes[:, masses.index(0)] / participation[:, 0] if 0 in masses else np.ones(5)
        mass = np.real(modal_a / (2j * TRUTH.poles.imag))
        scale = ModalScale(
            response="/mass0", reference="hammer", modal_a=modal_a, modal_mass=mass, modal_mass_std=0.1 * mass
        )
        return with_forces(one, ["hammer"], participation, scale)

    merged = merge_setups([part([0, 1, 2]), part([2, 3, 4])])
    residues = merged.shapes[:, :, None] * merged.participation[:, None, :]
    exact = TRUTH.shapes[:, :, None] * TRUTH.shapes[:, None, :1] / (2j * TRUTH.poles.imag[:, None, None])
    np.testing.assert_allclose(residues, exact, rtol=1e-9)
    # A shape over the root of its modal mass has unit modal mass, as the truth's shapes do.
    unit_mass = merged.shapes / np.sqrt(merged.scale.modal_mass)[:, None]
    np.testing.assert_allclose(np.abs(unit_mass), np.abs(TRUTH.shapes), rtol=1e-9)
    np.testing.assert_allclose(merged.scale.modal_mass_std, 0.1 * merged.scale.modal_mass)


def test_other_references_leave_participation_out_with_a_word():
    one = with_forces(setup([0, 1, 2]), ["hammer"], np.ones((5, 1), complex))
    other = with_forces(setup([0, 3, 4]), ["shaker"], np.ones((5, 1), complex))
    merged = merge_setups([one, other])
    assert merged.participation is None
    assert merged.references == ()
    assert any("different references" in note for note in merged.provenance.notes)


def test_harmonics_of_all_set_ups_are_named_once():
    lines = [MachineHarmonic(frequency_hz=value, reason="even") for value in (25.0, 12.5, 25.01)]
    merged = merge_setups([setup([0, 1], harmonics=tuple(lines[:2])), setup([0, 2], harmonics=tuple(lines[2:]))])
    assert [line.frequency_hz for line in merged.harmonics] == [12.5, 25.0]


def test_a_mode_that_does_not_move_at_the_shared_channels_has_no_partner():
    still = setup([0, 1])
    shapes = np.array(still.shapes)
    shapes[2] = [0.0, 1.0]
    merged = merge_setups([replace(still, shapes=shapes), setup([0, 2])])
    assert merged.frequency_hz.size == 4


@pytest.mark.parametrize(
    ("sets", "options", "message"),
    [
        ([setup([0, 1])], {}, "1 set of modes can't be merged"),
        ([setup([0, 1]), setup([0, 1], modes=[])], {}, "set-up 2 has no modes"),
        ([setup([0, 1]), setup([2, 3])], {}, "set-up 2 can't be merged with those before it: .*share no channel"),
        (
            [setup([0, 1]), setup([0, 1], channels=[replace(ALL[0], unit="m/s"), ALL[2]])],
            {},
            r"'/mass0' is in m/s\^2, but as '/mass0' of set-up 2 in m/s; bring both",
        ),
        ([setup([0, 1]), setup([0, 2], modes=[0])], {"references": ["/mass1"]}, "set-up 2 has no reference channel"),
        ([setup([0, 1]), setup([0, 2])], {"references": ["/mass7"]}, "no reference channel '/mass7'"),
        ([setup([0, 1]), setup([0, 2])], {"references": []}, "references is empty"),
        ([setup([0, 1], modes=[0]), setup([0, 2], modes=[4])], {}, r"no mode of set-up 2 \(6\.742 Hz\) is one of"),
    ],
)
def test_set_ups_that_do_not_fit_are_refused(sets, options, message):
    with pytest.raises(EstimateError, match=message):
        merge_setups(sets, **options)
