"""A value of the model that is a slip of the pen is found, alone, with another one, and beside an unknown force."""

import numpy as np
import pytest

from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.explanation.wrong_values import with_wrong_values, wrong_values
from chladni.gap.location.locate import locate
from chladni.gap.location.profile import profile_at
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import attached
from tests.gap.made_log import band_noise, measured, three_bodies


def located(typed: dict[str, float], *effects):
    """Where the gap of a model lies in which values were typed so many times too large; its parameters."""
    right = three_bodies()
    model = right.with_values({name: factor * right.parameters[name].value for name, factor in typed.items()})
    log, _ = measured(right.with_effects(effects), band_noise(3000, rms=150.0))
    tunables = Tunables.of(model)
    return locate(model, log, estimate_noise(log), tunables), tunables


def found_wrong(tunables, z) -> dict[str, float]:
    """Value over the model's of each that is outside of its tolerance."""
    places = {name: tunables.names.index(name) for name in tunables.wrong(z)}
    return {name: float(np.exp(tunables.tolerance[place] * z[place])) for name, place in places.items()}


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        pytest.param("j1.stiffness", 10.0, marks=pytest.mark.nightly),
        pytest.param("j1.stiffness", 0.1, marks=pytest.mark.nightly),
        pytest.param("j0.stiffness", 3.0, marks=pytest.mark.nightly),
        pytest.param("j2.damping", 10.0, marks=pytest.mark.nightly),
        pytest.param("b1.mass", 10.0, marks=pytest.mark.nightly),
    ],
)
def test_a_slip_of_a_factor_of_ten_is_found_with_its_right_value(name: str, factor: float) -> None:
    location, tunables = located({name: factor})
    # Another one may be doubted first; beside the right one it comes back inside its tolerance.
    last = wrong_values(location, tunables)[-1]
    assert last.effects == ()
    assert found_wrong(tunables, last.start_z) == pytest.approx({name: 1.0 / factor}, rel=0.15)
    # What is left with it, over the noise.
    assert profile_at(location.problem, (), last.start_z).chi < 1.2 < location.tuned.chi


@pytest.mark.nightly
def test_of_two_slips_the_second_is_found_beside_the_first() -> None:
    location, tunables = located({"j0.stiffness": 5.0, "j2.stiffness": 0.2})
    one, both = wrong_values(location, tunables)[:2]
    assert found_wrong(tunables, both.start_z) == pytest.approx({"j0.stiffness": 0.2, "j2.stiffness": 5.0}, rel=0.15)
    alone, together = (profile_at(location.problem, (), found.start_z).chi for found in (one, both))
    assert together < 0.01 * alone


@pytest.mark.nightly
def test_where_all_values_are_right_none_is_doubted() -> None:
    location, tunables = located({})
    assert wrong_values(location, tunables) == []


@pytest.mark.nightly
def test_a_body_that_is_heavier_than_its_tolerance_carries_something() -> None:
    location, tunables = located({}, attached("added_mass", "b1", {"mass": 2.5}))
    assert location.tuned.chi > 5.0
    assert all("b1.mass" not in found_wrong(tunables, one.start_z) for one in wrong_values(location, tunables))


@pytest.mark.nightly
def test_a_slip_hides_a_force_elsewhere_until_it_is_told_beside_it() -> None:
    spring = attached("hardening_stiffness", "j2", {"cubic": 2e12})
    location, tunables = located({"j0.stiffness": 4.0}, spring)
    place = next(one for one in location.ranked if "j2" in one.places[0].names)
    found = with_wrong_values(location, place, tunables)
    assert found is not None
    assert found.places == place.places
    assert found.profile.chi < 1.2 < place.profile.chi
    assert found_wrong(tunables, found.profile.z) == pytest.approx({"j0.stiffness": 0.25}, rel=0.15)
    # Beside a force that explains all no value is doubted.
    right, known = located({}, spring)
    place = next(one for one in right.ranked if "j2" in one.places[0].names)
    assert with_wrong_values(right, place, known) is None
