"""The whole diagnosis of a robot and its log."""

from collections.abc import Callable

from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.robots.answer import Answer
from chladni.gap.robots.pushes import PUSHED
from chladni.gap.robots.rival import likelier
from chladni.gap.robots.solved import solved
from chladni.gap.robots.support import require_in_the_air
from chladni.gap.robots.torques import Torques, torques_of
from chladni.gap.robots.words import all_terms
from chladni.models.effects.wording import nearest
from chladni.robots.joint_log import JointLog
from chladni.robots.robot import Robot
from chladni.signals.errors import SetupError
from chladni.signals.linear_algebra import in_one_thread

StepProgress = Callable[[str, float], None]

#: Words of docs/robots.md that have no column: what they name is part of ``unknown``.
WITHOUT_COLUMN = (PUSHED,)


@in_one_thread()
def diagnose_robot(
    robot: Robot,
    log: JointLog,
    *,
    leave_out: frozenset[str] = frozenset(),
    progress: StepProgress | None = None,
) -> Diagnosis:
    """Say what a robot's description lacks, joint by joint.

    The drives' torque (measured, or what the servos give for the commands) less the torque that the motion needs by
    inverse dynamics is what is missing; words are columns of it, weighed all together by the evidence of every
    diagnosis (docs/methods/robots.md).

    Parameters
    ----------
    leave_out
        Words, and words at a site as ``word@site``, that don't take part.
    progress
        Called with the name of the step and the share done.

    Raises
    ------
    ModelError
        When MuJoCo isn't installed, or nothing tells the torque of any joint.
    LogError
        When the log has no stretch that is long enough.
    SetupError
        When a word that is left out at a site can't be there.
    """
    tell = progress or (lambda _step, _share: None)
    tell("locating", 0.0)
    torques = torques_of(robot, log)
    require_in_the_air(torques)
    _require_sites(torques, leave_out)
    tell("explaining", 0.2)
    found = solved(torques, leave_out, lambda share: tell("explaining", 0.2 + 0.6 * share))
    tell("measuring the closing", 0.9)
    answer, rival = Answer(solved=found), None
    if answer.to_leave_out:
        # A law that looks alike in torques may follow the motion where the likeliest doesn't.
        other = Answer(solved=solved(torques, leave_out | answer.to_leave_out, lambda _: None))
        answer, rival = likelier(answer, other)
    told = answer.diagnosis(rival)
    tell("measuring the closing", 1.0)
    return told


def _require_sites(torques: Torques, left_out: frozenset[str]) -> None:
    for each in sorted(left_out):
        word, at, site = each.partition("@")
        if not at:
            continue
        sites = {term.site for term in all_terms(torques) if term.word == word}
        if site not in sites:
            advice = nearest(site, sorted(sites), "sites") if sites else f"leave it out everywhere with {word}"
            raise SetupError(f"no {word} at {site!r} to leave out; {advice}")
