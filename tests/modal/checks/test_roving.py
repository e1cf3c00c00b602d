"""Roving hammers and accelerometers: parts of a structure's matrix put together again."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.checks.driving_point import driving_points
from chladni.modal.checks.roving import join_references, over_hit_points, roving_hammer
from chladni.modal.experimental.half_power import HalfPower
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.testing import assert_close
from tests.modal.made_responses import chain, functions

F_HZ = np.arange(2.0, 60.0, 0.1)
BODIES = ("m1", "m2", "m3", "m4", "m5")


def hit_at(body, *, responses=("m2", "m5"), noise=0.0, seed=0):
    """One position of the hammer, whose channel always has the same name."""
    made = functions(chain(), F_HZ, references=(body,), responses=responses, noise=noise, seed=seed)
    return replace(made, references=(replace(made.references[0], name="/hammer.force"),))


def test_a_roving_hammer_becomes_a_row_of_responses():
    roved = roving_hammer([hit_at(body) for body in BODIES])
    expected = functions(chain(), F_HZ, references=("m2", "m5"))
    # The structure is reciprocal to rounding; near an antiresonance that is rounding of its largest value.
    np.testing.assert_allclose(roved.values, expected.values, rtol=1e-9, atol=1e-9)
    assert [channel.point for channel in roved.responses] == list(BODIES)
    assert {(channel.unit, channel.role) for channel in roved.responses} == {("m/s^2", "response")}
    assert {(channel.unit, channel.role) for channel in roved.references} == {("N", "reference")}
    assert len({channel.name for channel in roved.responses}) == 5
    assert roved.unit(0, 0) == "(m/s^2)/N"
    assert driving_points(roved.responses, roved.references) == ((1, 0, 1), (4, 1, 1))
    assert any("5 hit points taken as responses and 2 accelerometers" in note for note in roved.provenance.notes)


def test_modes_of_a_roving_hammer_are_those_of_the_structure():
    truth = chain().natural_modes()
    roved = roving_hammer([hit_at(body, noise=1e-3, seed=k) for k, body in enumerate(BODIES)])
    modes = HalfPower().identify(roved, frequencies_hz=truth.frequency_hz[:2])
    mac = np.abs(np.sum(modes.shapes * truth.shapes[:2].conj(), axis=1)) ** 2
    mac /= np.sum(np.abs(modes.shapes) ** 2, axis=1) * np.sum(np.abs(truth.shapes[:2]) ** 2, axis=1)
    assert np.all(mac > 0.999)


def test_std_and_coherence_stay_with_their_functions():
    parts = [hit_at(body, noise=0.01 * (k + 1), seed=k) for k, body in enumerate(BODIES)]
    parts = [replace(part, coherence=np.full(part.coherence.shape, 0.9 - 0.1 * k)) for k, part in enumerate(parts)]
    parts[1] = replace(parts[1], excited=F_HZ < 50.0)
    joined, roved = join_references(parts), roving_hammer(parts)
    for k, part in enumerate(parts):
        np.testing.assert_array_equal(joined.std[:, k], part.std[:, 0])
        np.testing.assert_array_equal(roved.std[k], part.std[:, 0])
        np.testing.assert_allclose(roved.coherence[k], 0.9 - 0.1 * k)
    np.testing.assert_allclose(joined.coherence, 0.5)
    np.testing.assert_array_equal(joined.excited, F_HZ < 50.0)


def test_a_roving_accelerometer_and_both_wandering_join_to_the_whole():
    whole = functions(chain(), F_HZ, references=("m1", "m4"), noise=0.01)

    def part(rows, columns):
        return replace(
            whole,
            values=whole.values[np.ix_(rows, columns)],
            std=whole.std[np.ix_(rows, columns)],
            coherence=whole.coherence[rows],
            responses=tuple(whole.responses[row] for row in rows),
            references=tuple(whole.references[column] for column in columns),
        )

    for parts in (
        [part([0, 1], [0, 1]), part([2], [0, 1]), part([3, 4], [0, 1])],
        [part([0, 1], [0]), part([2, 3, 4], [0]), part([0, 1, 2], [1]), part([3, 4], [1])],
        [whole],
    ):
        assert_close(join_references(parts), whole, rtol=0)


def test_channels_without_a_place_go_by_their_names():
    parts = [hit_at(body) for body in BODIES[:2]]
    named = [
        replace(
            part,
            responses=tuple(Channel(name=c.name, unit=c.unit) for c in part.responses),
            references=(Channel(name=f"/hit {k}", unit="N"),),
        )
        for k, part in enumerate(parts)
    ]
    assert [c.name for c in join_references(named).references] == ["/hit 0", "/hit 1"]
    same_name = [replace(part, references=(Channel(name="/hit", unit="N"),)) for part in named]
    with pytest.raises(EstimateError, match="'/hit' is in part 1 and in part 2; leave one out"):
        join_references(same_name)


def test_axes_at_one_point_get_names_of_their_own():
    part = hit_at("m1")
    across = replace(part, references=(replace(part.references[0], direction=(0.0, 0.0, -1.0)),))
    names = [channel.name for channel in join_references([part, across]).references]
    assert names == ["/hammer.force (m1, 1 0 0)", "/hammer.force (m1, 0 0 -1)"]


def test_parts_that_do_not_fit_are_refused():
    first, second = hit_at("m1"), hit_at("m2")
    with pytest.raises(EstimateError, match="no part to join"):
        join_references([])
    with pytest.raises(EstimateError, match=r"part 1 has 580 lines to 59.9 Hz, part 2 580 lines to 60.4"):
        join_references([first, replace(second, frequency_hz=F_HZ + 0.5)])
    decayed = replace(second, provenance=replace(second.provenance, window_decay_per_s=3.0))
    with pytest.raises(EstimateError, match="window of 0/s, part 2 of 3/s"):
        join_references([first, decayed])
    volts = tuple(replace(channel, unit="m/s") for channel in second.responses)
    with pytest.raises(EstimateError, match=r"'/m2.x' is in m/s in one part and in m/s\^2 in another"):
        join_references([first, replace(second, responses=volts)])
    with pytest.raises(EstimateError, match=r"'/m5.x' at m5 / '/hammer.force' at m1 is in part 1 and in part 2"):
        join_references([hit_at("m1", responses=("m5",)), hit_at("m1", responses=("m5",))])
    with pytest.raises(
        EstimateError, match=r"1 function of 4 not measured, the first '/m5.x' at m5 / '/hammer.force' at m2"
    ):
        join_references([hit_at("m1"), hit_at("m2", responses=("m2",))])


def test_only_motion_per_force_is_turned_round():
    strain = [replace(p, responses=tuple(replace(c, unit="V") for c in p.responses)) for p in (hit_at("m1"),)]
    with pytest.raises(EstimateError, match="is no motion"):
        roving_hammer(strain)
    mixed = hit_at("m1")
    mixed = replace(mixed, responses=(mixed.responses[0], replace(mixed.responses[1], unit="m")))
    with pytest.raises(EstimateError, match=r"responses in m and m/s\^2 can't be turned round together"):
        roving_hammer([mixed])


def row_of(*, response="m2", unit="m/s^2", hits=BODIES):
    """One accelerometer over several hit points, as a file holds them."""
    return replace(
        made := functions(chain(), F_HZ, references=hits, responses=(response,)),
        responses=tuple(replace(channel, unit=unit) for channel in made.responses),
    )


def test_one_response_over_several_forces_is_turned_round():
    row = row_of()
    turned = over_hit_points(row)
    np.testing.assert_array_equal(turned.values, row.values.transpose(1, 0, 2))
    np.testing.assert_array_equal(turned.std, row.std.transpose(1, 0, 2))
    assert [channel.point for channel in turned.responses] == list(BODIES)
    assert [channel.point for channel in turned.references] == ["m2"]
    assert turned.coherence.shape == (5, F_HZ.size)
    assert any("5 hit points taken as responses and 1 accelerometer" in note for note in turned.provenance.notes)
    # Turned once: what has more responses stays.
    assert over_hit_points(turned) is turned


def test_places_keep_their_names_and_a_reference_is_told_from_a_response():
    row = row_of(hits=("m1", "m2"))
    named = replace(
        row,
        responses=(replace(row.responses[0], name="2:+1"),),
        references=tuple(replace(c, name=f"{at}:+1 (reference)") for at, c in enumerate(row.references, start=1)),
    )
    turned = over_hit_points(named)
    assert [channel.name for channel in turned.responses] == ["1:+1", "2:+1"]
    assert [channel.name for channel in turned.references] == ["2:+1 (reference)"]


def test_a_sensor_of_anything_tells_shapes_over_the_forces_but_motions_are_no_forces():
    # What a strain gauge sees of a mode is a factor of all its hit points alike.
    assert len(over_hit_points(row_of(unit="V")).responses) == 5
    row = row_of()
    shaken = replace(row, references=tuple(replace(channel, unit="m/s^2") for channel in row.references))
    assert over_hit_points(shaken) is shaken
    mixed = replace(row, references=(replace(row.references[0], unit="N m"), *row.references[1:]))
    assert over_hit_points(mixed) is mixed
    square = functions(chain(), F_HZ, references=("m1", "m2"), responses=("m1", "m2"))
    assert over_hit_points(square) is square


def test_each_further_reference_has_spent_an_average():
    row = row_of()
    counted = replace(row, provenance=replace(row.provenance, effective_averages=20.0))
    assert over_hit_points(counted).provenance.effective_averages == 16.0
    unknown = replace(row, provenance=replace(row.provenance, effective_averages=0.0))
    assert over_hit_points(unknown).provenance.effective_averages == 0.0
