"""Sites that some sensors can't tell apart are one place, whatever units the sensors have."""

from dataclasses import replace

import numpy as np

from chladni.gap.plant.linear_view import LinearView
from chladni.gap.plant.places import placed, sites_of
from chladni.gap.plant.record_lines import all_lines
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import RATE_HZ, band_noise, three_bodies, white_floor

OUTPUTS = (
    StructureOutput(name="foot", measures="displacement", at="b0"),
    StructureOutput(name="head", measures="displacement", at="b2"),
    StructureOutput(name="cell", measures="force", at="j2"),
)


def places_of(outputs, rms):
    model = replace(three_bodies(), outputs=outputs)
    names = tuple(one.name for one in outputs)
    view = LinearView(model.compile(), all_lines(512, RATE_HZ), band_noise(512), tuple(range(len(outputs))))
    found = placed(view, sites_of(view.compiled, names), names, white_floor(rms))
    return [set(place.names) for place in found]


def test_a_force_in_newtons_leaves_displacements_in_metres_their_say():
    # A displacement of micrometres has a millionth of the numbers of the force that it stands beside.
    found = places_of(OUTPUTS, [1e-8, 1e-8, 0.01])
    joints = [place & {"j0", "j1", "j2"} for place in found]
    assert sorted(map(sorted, filter(None, joints))) == [["j0"], ["j1"], ["j2"]]


def test_a_joint_to_the_ground_is_one_place_with_its_body():
    found = places_of(OUTPUTS, [1e-8, 1e-8, 0.01])
    assert {"j0", "b0"} in [place & {"j0", "b0", "b1"} for place in found]


def test_one_sensor_sees_one_place():
    assert len(places_of(OUTPUTS[:1], [1e-8])) == 1


def test_a_sensor_without_noise_counts_nothing():
    known = np.array([1e-8, 1e-8, 0.0])
    assert places_of(OUTPUTS, known)[0] == places_of(OUTPUTS[:2], known[:2])[0]
