"""Trial of what was found by simulation: stretches of the log that no fit saw judge it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chladni.gap.calibration import SAME
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.forward import by_effort, machine_of, simulated
from chladni.gap.robots.term import Term
from chladni.gap.robots.torques import Torques
from chladni.robots.machine import Machine, as_described
from chladni.signals.arrays import Mask, Real

#: Least length of the blocks of which every other one judges, in periods of the cutoff.
_PERIODS = 16.0

#: First and last sample of each.
Runs = list[tuple[int, int]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Confirmed:
    """What simulation says of the description as it is, and with what was found.

    Attributes
    ----------
    before, tuned, after
        Error of the simulated positions over the motion, both RMS on the stretches held out, pooled over joints that
        move; infinite where a run goes astray. Of the description, of the same within its tolerances, and with what
        was found.
    joints
        Names.
    per_joint_before, per_joint_tuned, per_joint_after
        ``[joint]``: the same of each; NaN where it doesn't move.
    motion
        ``[joint]``: RMS of the measured position about its mean, rad (m).
    time_s
        ``[sample]`` from the log's start.
    measured
        ``[joint, sample]`` positions.
    course_before, course_tuned, course_after
        The same of the simulations.
    judged
        ``[sample]``: the stretches that judge.
    horizon_s
        How long a run lasts before it starts from the log's pose again.
    held_out
        Whether no fit saw what judges; False when the log is too short for that.
    """

    before: float
    tuned: float
    after: float
    joints: tuple[str, ...]
    per_joint_before: Real
    per_joint_tuned: Real
    per_joint_after: Real
    motion: Real
    time_s: Real
    measured: Real
    course_before: "Course"
    course_tuned: "Course"
    course_after: "Course"
    judged: Mask
    horizon_s: float
    held_out: bool

    @property
    def denies(self) -> bool:
        """Whether positions come out worse with what was found than without it, or not at all."""
        return self.after > self.tuned or self.after > 1.0

    @property
    def worse(self) -> Mask:
        """``[joint]``: whether its position comes out clearly worse with what was found than without it."""
        return np.asarray(self.per_joint_after > SAME * self.per_joint_tuned)


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """Runs of one machine from the log's poses.

    Attributes
    ----------
    runs
        Those that judge, and the others.
    """

    machine: Machine
    torques: Torques
    runs: tuple[Runs, Runs]

    @cached_property
    def judged(self) -> Real:
        """``[joint, sample]`` where it judges; NaN elsewhere."""
        return simulated(self.machine, self.torques, self.runs[0])

    @cached_property
    def whole(self) -> Real:
        """``[joint, sample]``; NaN where nothing is run."""
        if not self.runs[1]:
            return self.judged
        others = simulated(self.machine, self.torques, self.runs[1])
        return np.where(np.isnan(self.judged), others, self.judged)


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial:
    """Runs of a log's machines from its poses, by its commands.

    Every other block of the log judges what was fitted to the rest. A run lasts a block where the drives hold
    positions, and a period of the cutoff where torques or speeds are asked, since then nothing brings a joint back.
    """

    torques: Torques

    def of(self, terms: Sequence[Term]) -> Confirmed | None:
        """Run the description, and the machine that was found.

        Returns
        -------
        Confirmed | None
            None where the drive of a joint isn't known: then it can't be run.
        """
        if not np.all(self.torques.driven):
            return None
        courses = self._described, self._tuned, self._course(terms)
        return _told(self.torques, courses, self._judge, held_out=self._held_out)

    @cached_property
    def _described(self) -> Course:
        """As the description has it, whatever was found."""
        memory = self.torques.memory
        if "as described" not in memory:
            memory["as described"] = self._run(as_described(self.torques.robot))
        found: Course = memory["as described"]
        return found

    @cached_property
    def _tuned(self) -> Course:
        return self._course(())

    def _course(self, terms: Sequence[Term]) -> Course:
        contest = Contest(self.torques, terms=terms, taking_part=self._learns)
        return self._run(machine_of(contest, contest.fit(terms)))

    def _run(self, machine: Machine) -> Course:
        judging, others = (self._blocks[1::2], self._blocks[::2]) if self._held_out else (self._blocks, [])
        runs = runs_of(self.torques, judging), runs_of(self.torques, others)
        return Course(machine=machine, torques=self.torques, runs=runs)

    @property
    def _learns(self) -> Mask | None:
        """``[coarse]``: what machines are fitted to; all of it when None."""
        return ~self._judge[self.torques.kept] if self._held_out else None

    @property
    def _judge(self) -> Mask:
        """``[sample]``."""
        judge = np.zeros(self.torques.log.position.shape[1], dtype=bool)
        for a, b in self._blocks[1::2]:
            judge[a:b] = True
        return judge if self._held_out else ~judge

    @property
    def _held_out(self) -> bool:
        return len(self._blocks) > 1

    @cached_property
    def _blocks(self) -> Runs:
        rate, found = self.torques.log.sample_rate_hz, []
        least = max(int(_PERIODS / self.torques.cutoff_hz * rate), 2)
        for a, b in self.torques.stretches:
            edges = np.linspace(a, b, max((b - a) // least, 1) + 1).astype(np.intp)
            found += list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
        return found


def runs_of(torques: Torques, blocks: Runs) -> Runs:
    """Give blocks as runs: whole where the drives hold positions, else in periods of the cutoff."""
    if torques.log.command_kind == "position" and not by_effort(torques):
        return blocks
    count = max(round(torques.log.sample_rate_hz / torques.cutoff_hz), 2)
    return [(start, min(start + count, b)) for a, b in blocks for start in range(a, b, count)]


def _told(torques: Torques, trial: Sequence["Course"], judge: Mask, *, held_out: bool) -> Confirmed:
    measured, courses = torques.log.position, [one.judged for one in trial]
    there = judge & ~np.isnan(courses).any(axis=(0, 1))
    about = measured[:, there] - np.mean(measured[:, there], axis=1, keepdims=True)
    motion = np.sqrt(np.mean(about**2, axis=1))
    moves = motion > torques.resolution
    size = np.where(moves, motion, np.nan)
    per_joint = [np.sqrt(np.mean((one[:, there] - measured[:, there]) ** 2, axis=1)) / size for one in courses]
    whole = [float(np.sqrt(np.mean(one[moves] ** 2))) if moves.any() else float("nan") for one in per_joint]
    return Confirmed(
        before=whole[0], tuned=whole[1], after=whole[2], joints=torques.log.joints,
        per_joint_before=per_joint[0], per_joint_tuned=per_joint[1], per_joint_after=per_joint[2], motion=motion,
        time_s=torques.log.time_s, measured=measured, course_before=trial[0], course_tuned=trial[1],
        course_after=trial[2], judged=there, held_out=held_out,
        horizon_s=max(b - a for runs in trial[0].runs for a, b in runs) / torques.log.sample_rate_hz,
    )  # fmt: skip
