"""The test that every effect gets: bounds, sites, extreme arguments, symmetry, no strength, machine code."""

import pickle
import re
from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from pathlib import Path

import numba
import numpy as np
import pytest

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import PortKind
from chladni.models.core.port_law import PortLaw
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.effects.catalogue import CATALOGUE, FAMILIES
from chladni.models.effects.effect_kind import EffectKind
from tests.models.effects import own_effect
from tests.models.effects.small_models import SITES, one_body, two_bodies, with_loop

KINDS = (*CATALOGUE.values(), own_effect.CUBIC_DAMPING)
#: The ground has no velocity that could push.
BETWEEN_BODIES = [CATALOGUE["gyroscopic"]]
VARIANTS = [pytest.param(kind, one.name, id=f"{kind.name}-{one.name}") for kind in KINDS for one in kind.variants]
ODD = [
    pytest.param(kind, one.name, id=f"{kind.name}-{one.name}") for kind in KINDS for one in kind.variants if one.odd
]
PLACES = [
    pytest.param(kind, one.name, site, id=f"{kind.name}-{one.name}-{site}")
    for kind in KINDS
    for one in kind.variants
    for site in kind.sites
]
FREQUENCY_HZ = np.linspace(0.1, 20.0, 40)
EXTREME = (0.0, 1e-300, -1e-30, 1e-9, -1e-3, 0.3, -7.0, 1e4, -1e9, 1e30, -1e50)


def _made(
    kind: EffectKind, variant: str, site: PortKind, values: Mapping[str, float] | None = None
) -> AttachedEffect:
    numbers = {**kind.parameters.numbers(), **(values or {})}
    source = "speed" if kind.needs_source else None
    return attached(kind, _place(kind, site), numbers, variant=variant, source=source)


def _place(kind: EffectKind, site: PortKind) -> str:
    return "mass~other" if kind in BETWEEN_BODIES else SITES[site]


def _plant(kind: EffectKind) -> CompiledModel:
    return two_bodies() if kind in BETWEEN_BODIES else one_body()


def _laws(kind: EffectKind, variant: str, values: Mapping[str, float] | None = None) -> list[PortLaw]:
    """Laws at every kind of site, inside a loop where a signal can be in one."""
    laws = []
    for site in kind.sites:
        plant = with_loop(_plant(kind)) if site == "input" else _plant(kind)
        laws += _made(kind, variant, site, values).attach(plant, in_loop=site == "output").laws
    return laws


def _called(law: PortLaw, d: float, s: float, t: float, state: list[float]) -> list[float]:
    rates = [0.0] * len(law.state)
    return [law.function(d, s, t, law.parameters, state, rates), *rates]


def test_families_are_those_of_the_vocabulary() -> None:
    assert {family: set(names) for family, names in FAMILIES.items()} == {
        "friction": {"coulomb_friction", "stribeck_friction", "hysteresis"},
        "stiffness": {
            "hardening_stiffness", "softening_stiffness", "one_sided_stop", "backlash", "varying_stiffness",
            "geometric",
        },
        "damping": {"quadratic_damping"},
        "attachment": {"extra_mode", "added_mass"},
        "actuator": {"delay", "lag", "saturation", "dead_zone", "rate_limit", "ripple", "harmonics"},
        "sensor": {
            "gain_error", "cross_axis", "mounting_resonance", "ac_coupling", "time_offset", "clipping",
            "quantization", "anti_alias", "clock_drift", "swapped_channels", "offset",
        },
        "disturbance": {"base_vibration", "tonal_disturbance", "unbalance"},
        "coupling": {"missing_link", "gyroscopic"},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "sites", "parameters"),
    [
        ("coulomb_friction", {"joint"}, {"force", "offset"}),
        ("stribeck_friction", {"joint"}, {"coulomb", "static", "speed"}),
        ("quadratic_damping", {"joint"}, {"coefficient"}),
        ("hardening_stiffness", {"joint"}, {"cubic"}),
        ("softening_stiffness", {"joint"}, {"cubic"}),
        ("backlash", {"joint"}, {"gap"}),
        ("one_sided_stop", {"joint"}, {"stiffness", "clearance"}),
        ("hysteresis", {"joint"}, {"force", "yield", "shape"}),
        ("extra_mode", {"body"}, {"mass", "frequency", "damping_ratio"}),
        ("added_mass", {"body"}, {"mass"}),
        ("varying_stiffness", {"joint"}, {"relative_change", "time"}),
        ("delay", {"input"}, {"delay"}),
        ("lag", {"input"}, {"time_constant"}),
        ("saturation", {"input"}, {"limit"}),
        ("dead_zone", {"input"}, {"width"}),
        ("rate_limit", {"input"}, {"rate"}),
        ("ripple", {"joint", "input"}, {"amplitude", "period", "phase"}),
        ("gain_error", {"input", "output"}, {"gain"}),
        ("cross_axis", {"output"}, {"coefficient"}),
        ("mounting_resonance", {"output"}, {"frequency", "damping_ratio"}),
        ("ac_coupling", {"output"}, {"corner"}),
        ("time_offset", {"output"}, {"offset"}),
        ("clipping", {"output"}, {"limit"}),
        ("quantization", {"output"}, {"step"}),
        ("base_vibration", {"ground"}, {"level", "band"}),
        ("tonal_disturbance", {"body", "output"}, {"frequency", "amplitude"}),
        ("missing_link", {"pair"}, {"stiffness", "damping"}),
        ("gyroscopic", {"pair"}, {"coefficient"}),
        ("geometric", {"joint"}, {"stiffness", "length"}),
        ("anti_alias", {"output", "input"}, {"corner", "order"}),
        ("clock_drift", {"output"}, {"ppm", "offset"}),
        ("swapped_channels", {"output_pair"}, set()),
        ("offset", {"output"}, {"value"}),
        ("harmonics", {"input"}, {"second", "third"}),
        ("unbalance", {"body"}, {"moment", "frequency"}),
    ],
)
def test_words_sites_and_parameters_are_those_of_the_vocabulary(
    name: str, sites: set[str], parameters: set[str]
) -> None:
    kind = CATALOGUE[name]
    assert kind.name == name
    assert set(kind.sites) == sites
    assert parameters <= set(kind.parameters)
    # What the vocabulary doesn't name must not have to be given.
    assert set(kind.required) <= parameters


def test_the_catalogue_has_35_words() -> None:
    assert len(CATALOGUE) == 35


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_bounds_are_finite_and_hold_the_usual_range(kind: EffectKind, variant: str) -> None:
    for parameter in kind.parameters_of(variant).values():
        assert isfinite(parameter.minimum)
        assert isfinite(parameter.maximum)
        assert parameter.minimum <= parameter.low < parameter.high <= parameter.maximum
        assert parameter.usual
        assert parameter.unit
    assert kind.meaning
    assert kind.neutral
    assert kind.variant(variant).formula


@pytest.mark.parametrize(("kind", "variant", "site"), PLACES)
def test_attaches_at_every_kind_of_site_and_changes_the_model(kind: EffectKind, variant: str, site: PortKind) -> None:
    before = _plant(kind)
    after = _made(kind, variant, site).attach(before)
    assert after.outputs == before.outputs
    assert after.inputs == before.inputs
    assert _fingerprint(after) != _fingerprint(before)
    assert after.is_linear() or not kind.linear


@pytest.mark.parametrize(("kind", "variant", "site"), PLACES)
def test_attaches_in_a_loop_as_part_of_it(kind: EffectKind, variant: str, site: PortKind) -> None:
    if site == "input":
        before = with_loop(one_body())
        after = _made(kind, variant, site).attach(before)
    else:
        before = _plant(kind)
        after = with_loop(_made(kind, variant, site).attach(before, in_loop=site == "output"))
        before = with_loop(before)
    assert not after.input_maps
    # A recorder's clock is none of the controller's business.
    assert not after.output_maps or kind.name == "clock_drift"
    assert after.input_delays_s == before.input_delays_s
    assert _fingerprint(after) != _fingerprint(before)


@pytest.mark.parametrize(("kind", "variant", "site"), PLACES)
def test_without_strength_nothing_changes(kind: EffectKind, variant: str, site: PortKind) -> None:
    before = _plant(kind)
    after = _made(kind, variant, site, kind.neutral).attach(before)
    wanted = before.frequency_response(FREQUENCY_HZ)
    # A mount at 1e9 Hz is the stiffest there is: the phase it leaves at 20 Hz is 2e-9.
    np.testing.assert_allclose(after.frequency_response(FREQUENCY_HZ), wanted, rtol=1e-8)
    samples = np.random.default_rng(1).normal(size=50)
    for _, action in (*after.input_maps, *after.output_maps):
        np.testing.assert_allclose(action(samples, 100.0), samples, rtol=1e-12)
    for generated in after.generated:
        assert not np.any(generated.samples(np.arange(10) / 1000.0))


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_laws_without_strength_give_no_force(kind: EffectKind, variant: str) -> None:
    for law in _laws(kind, variant, kind.neutral):
        for d in (0.0, 1e-3, -2.0, 40.0):
            settled = [d if kind.name == "rate_limit" else 0.0] * len(law.state)
            assert _called(law, d, 0.7 * d, 0.5, settled)[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_laws_stay_finite_at_extreme_arguments(kind: EffectKind, variant: str) -> None:
    for law in _laws(kind, variant):
        for d in EXTREME:
            for s in EXTREME:
                for state in (0.0, 1.0, -1e6):
                    for t in (0.0, 1e6):
                        assert np.all(np.isfinite(_called(law, d, s, t, [state] * len(law.state))))


@pytest.mark.parametrize(("kind", "variant"), ODD)
def test_laws_that_claim_it_are_odd(kind: EffectKind, variant: str) -> None:
    rng = np.random.default_rng(2)
    for law in _laws(kind, variant):
        for d, s, state in rng.normal(size=(50, 3)) * np.array([1e-2, 1e-2, 1.0]):
            there = np.array(_called(law, d, s, 0.3, [state] * len(law.state)))
            back = np.array(_called(law, -d, -s, 0.3, [-state] * len(law.state)))
            np.testing.assert_allclose(back, -there, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(("kind", "variant"), VARIANTS)
def test_machine_code_gives_what_python_gives(kind: EffectKind, variant: str) -> None:
    rng = np.random.default_rng(3)
    for law in {law.function: law for law in _laws(kind, variant)}.values():
        compiled = _machine_code(law.function)
        parameters = np.array(law.parameters)
        for d, s, t, state in rng.normal(size=(50, 4)) * np.array([1e-2, 1e-1, 1.0, 1.0]):
            rates = np.zeros(len(law.state))
            given = compiled(d, s, abs(t), parameters, np.full(len(law.state), state), rates)
            wanted = _called(law, d, s, abs(t), [state] * len(law.state))
            np.testing.assert_allclose([given, *rates], wanted, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(("kind", "variant", "site"), PLACES)
def test_effects_and_what_they_attach_survive_a_process_boundary(
    kind: EffectKind, variant: str, site: PortKind
) -> None:
    effect = _made(kind, variant, site)
    again = pickle.loads(pickle.dumps(effect))  # noqa: S301 - our own bytes
    assert again.values == effect.values
    assert _fingerprint(again.attach(_plant(kind))) == _fingerprint(effect.attach(_plant(kind)))
    pickle.dumps(effect.attach(_plant(kind)))


def test_the_user_page_has_every_word_parameter_and_variant() -> None:
    page = (Path(__file__).parents[3] / "docs" / "effects.md").read_text()
    for kind in CATALOGUE.values():
        section = re.search(rf"^### `{kind.name}`.*?(?=^##)", page, re.DOTALL | re.MULTILINE)
        assert section, f"docs/effects.md has no section on {kind.name}"
        for variant in kind.variants:
            assert f"`{variant.name}`" in section[0]
            for parameter in kind.parameters_of(variant.name).values():
                unit = "-" if parameter.unit == "1" else parameter.unit
                bounds = rf"{re.escape(f'{parameter.minimum:g}')} to {re.escape(f'{parameter.maximum:g}')}"
                row = rf"\| `{parameter.name}` \| {re.escape(unit)} \| .* \| {bounds} \|"
                assert re.search(row, section[0]), f"{kind.name}: no row for {parameter.name} [{unit}], {bounds}"


def test_the_user_page_shows_the_effect_that_is_tested_here() -> None:
    page = (Path(__file__).parents[3] / "docs" / "effects.md").read_text()
    source = Path(own_effect.__file__).read_text()
    assert source.strip() in page


def _machine_code(function):  # type: ignore[no-untyped-def]
    array = numba.float64[::1]
    return numba.njit(numba.float64(numba.float64, numba.float64, numba.float64, array, array, array))(function)


def _fingerprint(compiled: CompiledModel) -> tuple[object, ...]:
    """Everything that acts in a model, in a form that can be compared."""
    laws = tuple((law.port, law.function.__qualname__, law.parameters) for law in compiled.laws)
    maps = tuple((place, pickle.dumps(action)) for place, action in (*compiled.input_maps, *compiled.output_maps))
    generated = tuple(one.samples(np.arange(3) / 1000).tobytes() for one in compiled.generated)
    linear = compiled.frequency_response(FREQUENCY_HZ).tobytes()
    return laws, compiled.delays, maps, generated, compiled.input_delays_s, compiled.output_offsets_s, linear


def test_the_fingerprint_sees_a_changed_law() -> None:
    one = _made(CATALOGUE["quadratic_damping"], "quadratic", "joint").attach(one_body())
    other = replace(one, laws=(replace(one.laws[0], parameters=(1.0,)),))
    assert _fingerprint(one) != _fingerprint(other)
