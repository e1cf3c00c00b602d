"""The sentences on a robot: one a joint, like ones together."""

from dataclasses import replace

import pytest

from chladni.gap.records.diagnosis import Cause, Diagnosis, FittedNumber, Ranked, SiteShare
from chladni.viewers.robot_summary import robot_sentences, robot_unknown
from tests import made_diagnosis as made

N_M, DAMPING = "N m", "N m s/rad"


def cause(effect: str, site: str, probability: float = 0.9, **numbers: tuple[float, float, str]) -> Cause:
    parameters = {name: FittedNumber(value=one, std=std, unit=unit) for name, (one, std, unit) in numbers.items()}
    return Cause(
        effect=effect, site=site, probability=probability, group=(site,), alternatives=(), parameters=parameters
    )


def rubs(site: str, force: float, std: float = 0.1, probability: float = 0.9) -> Cause:
    return cause("coulomb_friction", site, probability, force=(force, std, N_M))


def sentences(*causes: Cause, verdict: str = "effect") -> list[str]:
    return list(robot_sentences(replace(made.diagnosis(), causes=causes, verdict=verdict)))


def test_few_causes_are_one_sentence() -> None:
    told = sentences(
        rubs("elbow_flex", 4.6, probability=0.88),
        cause("delay", "all commands", 0.97, delay=(8e-3, 2e-4, "s")),
        cause("payload", "flange", 0.95, mass=(1.5, 0.03, "kg"), x=(0.0, 0.01, "m")),
    )
    assert told == [
        (
            "elbow_flex rubs: Coulomb 4.60 ± 0.10 N m (88 %); all commands arrive 8.00 ± 0.20 ms late (97 %); "
            "flange carries 1.500 ± 0.030 kg more (95 %)."
        )
    ]


def test_what_one_joint_has_is_one_clause_as_sure_as_the_less_sure() -> None:
    viscous = cause("viscous_friction", "hip", 0.7, coefficient=(0.5, 0.1, DAMPING))
    armature = replace(
        cause("armature", "hip"),
        parameters={"inertia": FittedNumber(value=0.2, std=0.01, unit="kg m^2", nominal=0.1)},
    )
    assert sentences(armature, viscous, rubs("hip", 2.0)) == [
        (
            "hip rubs: Coulomb 2.00 ± 0.10 N m, viscous 0.50 ± 0.10 N m s/rad, and has an armature of "
            "0.200 ± 0.010 kg m² where the description has 0.1 kg m² (70 %)."
        )
    ]


def test_joints_that_are_alike_share_a_clause() -> None:
    calves = [rubs(f"{leg}_calf", force) for leg, force in (("FL", 1.0), ("FR", 1.1), ("RL", 1.2), ("RR", 1.05))]
    assert sentences(*calves) == ["FL_calf, FR_calf, RL_calf and RR_calf rub: Coulomb 1 to 1.2 N m (90 %)."]


def test_joints_that_differ_or_are_two_stand_alone() -> None:
    told = sentences(rubs("a", 1.0), rubs("b", 1.1), rubs("c", 5.0))
    assert told == [
        (
            "a rubs: Coulomb 1.00 ± 0.10 N m (90 %); b rubs: Coulomb 1.10 ± 0.10 N m (90 %); "
            "c rubs: Coulomb 5.00 ± 0.10 N m (90 %)."
        )
    ]


def test_many_causes_begin_with_what_there_is() -> None:
    told = sentences(
        *(rubs(f"joint_{place}", 2.0**place) for place in range(6)),
        cause("lag", "joint_1", time_constant=(0.02, 0.001, "s")),
    )
    assert told[0] == "Coulomb friction at 6 sites and lag at joint_1."
    assert len(told) == 7
    late = cause("delay", "all commands", 0.97, delay=(8e-3, 2e-4, "s"))
    both = sentences(late, *(rubs(f"joint_{place}", 2.0**place) for place in range(6)))
    assert both[1] == "All commands arrive 8.00 ± 0.20 ms late (97 %)."
    assert sentences(late) == [both[1]]
    assert told[2] == "joint_1 rubs: Coulomb 2.00 ± 0.10 N m, and follows with a lag of 20.0 ± 1.0 ms (90 %)."


def test_words_that_come_later_are_told_by_their_name_and_numbers() -> None:
    ripple = cause("gear_play", "wrist", width=(0.01, 1e-3, "rad"))
    assert sentences(ripple) == ["wrist has gear play (width 10.0 ± 1.0 mrad) (90 %)."]


def test_both_joints_of_a_pair_are_said() -> None:
    pair = cause("viscous_friction", "joint_5~joint_6", sense=(1.0, 0.0, "1"), coefficient=(0.6, 0.04, DAMPING))
    assert sentences(pair) == ["joint_5 with joint_6 rubs: viscous 0.600 ± 0.040 N m s/rad (90 %)."]


def test_wrong_values_are_no_missing_effect() -> None:
    number = FittedNumber(value=0.0, std=0.01, unit=DAMPING, nominal=0.5)
    wrong = replace(cause("parameter", "thigh.damping"), parameters={"value": number})
    (told,) = sentences(wrong, verdict="parameters")
    assert told.startswith("Nothing is missing, but values are wrong: thigh.damping is ")
    assert "where the description has 0.5 N m s/rad" in told


def unknown(**changed: object) -> Diagnosis:
    found = made.diagnosis()
    sites = (SiteShare(name="a", share=0.1), SiteShare(name="b", share=0.9))
    found = replace(found, where=replace(found.where, sites=sites), left=None, verdict="unknown", causes=())
    return replace(found, **changed)


def test_of_what_is_unknown_the_joints_are_told_and_what_torques_suggest() -> None:
    ranking = tuple(
        Ranked(effect="parameter", site=f"{site}.damping", probability=0.9, gap=None, log_evidence=None)
        for site in ("a", "b", "c")
    )
    _, where, suggested = robot_unknown(unknown(ranking=ranking))
    assert where == "Of the torque that is missing there is 90 % at b and 10 % at a."
    assert suggested == "Torques alone suggest wrong damping at 3 sites."


@pytest.mark.parametrize("tuned", [140.0, float("inf")])
def test_a_simulation_that_goes_astray_is_not_told_in_percent(tuned: float) -> None:
    gap = replace(made.diagnosis().gap, tuned=tuned, by="windows")
    first, *_ = robot_unknown(unknown(gap=gap, ranking=()))
    assert first.endswith("simulated positions err by more than the motion itself.")
