"""Causes at links and in the world: what is carried, how the base stands, and what no word says."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from chladni_withheld.case import PARAMETER, Matrix
from chladni_withheld.robots.cause import WORLD, Cause, Stage, loaded, share
from chladni_withheld.robots.excitation import Rng
from chladni_withheld.robots.machine import Machine


def payload(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """A mass that nobody told of, at a last link: of the arm, or of a leg."""
    model = stage.scene.robot.model
    joint = int(rng.choice([index - 1 for index in range(1, model.njoints) if len(model.subtrees[index]) == 1]))
    arm = sum(model.inertias[index].mass for index in range(1, model.njoints))
    mass = float(rng.uniform(0.5, 2.5)) if arm > 3.0 and len(set(model.parents)) == model.nv else 0.0
    mass = mass or float(rng.uniform(0.3, 1.5)) * float(model.inertias[joint + 1].mass)
    centre = rng.uniform(-1.0, 1.0, 3) * np.array([0.04, 0.04, 0.08])
    link = stage.scene.robot.links[joint]
    body = pin.Inertia(mass, centre, mass * 0.03**2 * np.eye(3))
    numbers = {"mass": mass, **dict(zip(("x", "y", "z"), centre.tolist(), strict=True))}
    return Cause(
        effect="payload",
        site=link,
        law="rigid",
        parameters=numbers,
        link=joint,
        change=lambda machine: _heavier(machine, joint, body),
        also=((PARAMETER, f"{link}.mass"),),
    )


def _heavier(machine: Machine, joint: int, body: pin.Inertia) -> Machine:
    model = machine.model.copy()
    model.inertias[joint + 1] = model.inertias[joint + 1] + body
    return replace(machine, model=model)


def heavy_link(share: float, stage: Stage, joint: int) -> Cause:
    """A link that is heavier by a share than its description says."""
    own = stage.scene.robot.model.inertias[joint + 1]
    link = stage.scene.robot.links[joint]
    body = pin.Inertia(share * own.mass, own.lever, share * own.inertia)
    return Cause(effect=PARAMETER, site=f"{link}.mass", law="heavier", link=joint, also=(("payload", link),),
                 parameters={"nominal": own.mass, "true": (1.0 + share) * own.mass},
                 change=lambda machine: _heavier(machine, joint, body))  # fmt: skip


def gravity_tilt(rng: Rng, _stage: Stage, _joint: int) -> Cause:
    """A base that isn't level: turned about x, then about y."""
    angles = np.deg2rad(rng.choice([-1.0, 1.0], 2) * rng.uniform(1.5, 8.0, 2))

    def change(machine: Machine) -> Machine:
        model = machine.model.copy()
        turn = pin.rpy.rpyToMatrix(float(angles[0]), float(angles[1]), 0.0)
        model.gravity = pin.Motion(turn.T @ machine.model.gravity.linear, np.zeros(3))
        return replace(machine, model=model)

    return Cause(effect="gravity_tilt", site=WORLD, law="rotation", change=change,
                 parameters={"about_x": float(angles[0]), "about_y": float(angles[1])})  # fmt: skip


def push(rng: Rng, stage: Stage, joint: int) -> Cause:
    """Somebody leans against a link for half a second."""
    begin_s = float(rng.uniform(0.2, 0.8) * stage.scene.recorder.length_s)
    force = rng.normal(size=3)
    force /= np.linalg.norm(force)
    model = stage.scene.machine.model
    middle = stage.quiet.link[:, np.searchsorted(stage.quiet.t_s, begin_s)]
    # As hard as the joints feel that much.
    print_over = _jacobian(model, model.createData(), middle, joint).T @ force
    felt = int(np.argmax(np.abs(print_over) / stage.swing))
    force *= float(rng.uniform(0.8, 2.0) * stage.swing[felt]) / max(abs(float(print_over[felt])), 1e-9)
    sites = [stage.name(felt), stage.name(joint)]

    def load(model: pin.Model, data: pin.Data, t: float, q: Matrix, _v: Matrix) -> Matrix:
        if not begin_s <= t < begin_s + 0.5:
            return np.zeros(q.size)
        found: Matrix = _jacobian(model, data, q, joint).T @ force
        return found * float(np.sin(np.pi * (t - begin_s) / 0.5))

    return loaded("push", stage.scene.robot.links[joint], "half sine",
                   {"start": begin_s, "end": begin_s + 0.5, "force": float(np.linalg.norm(force))}, load,
                   tuple(("push", site) for site in dict.fromkeys(sites)))  # fmt: skip


def _jacobian(model: pin.Model, data: pin.Data, q: Matrix, joint: int) -> Matrix:
    """Of the link's origin, in the world's axes: ``[axis, joint]``."""
    pin.computeJointJacobians(model, data, q)
    found: Matrix = pin.getJointJacobian(model, data, joint + 1, pin.LOCAL_WORLD_ALIGNED)[:3]
    return found


def _pair(rng: Rng, stage: Stage) -> tuple[int, int]:
    """Two joints of which one moves the other's link."""
    model = stage.scene.robot.model
    pairs = [(a - 1, b - 1) for a in range(1, model.njoints) for b in model.subtrees[a].tolist() if a != b]
    first, second = pairs[int(rng.integers(len(pairs)))]
    return first, second


def coupled_spring(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """A cable over two joints."""
    first, second = _pair(rng, stage)
    way = np.zeros(len(stage.scene.robot.joints))
    way[first], way[second] = 1.0, float(rng.uniform(0.5, 1.5) * rng.choice([-1.0, 1.0]))
    stretch = way @ stage.quiet.link
    swing = float(np.sqrt(stage.swing[first] * stage.swing[second]))
    stiffness, rest = float(rng.uniform(0.4, 1.0)) * swing / float(stretch.std()), float(stretch.mean())
    both, also = _alike("spring", stage.name(first), stage.name(second), as_word="joint_spring")
    return loaded("coupled_spring", both, "linear", {"stiffness": stiffness},
                   lambda _model, _data, _t, q, _v: -stiffness * (float(way @ q) - rest) * way, also)  # fmt: skip


def coupled_friction(rng: Rng, stage: Stage, _joint: int) -> Cause:
    """A wrist whose two motors turn one gear: friction on the sum of their speeds."""
    first, second = _pair(rng, stage)
    way = np.zeros(len(stage.scene.robot.joints))
    way[first] = way[second] = 1.0
    force = share(rng, 0.3, 0.7) * float(np.sqrt(stage.swing[first] * stage.swing[second]))
    soft = 0.05 * float(np.hypot(stage.fast[first], stage.fast[second]))
    both, also = _alike("friction", stage.name(first), stage.name(second), as_word="coulomb_friction")
    return loaded("coupled_friction", both, "tanh", {"force": force},
                   lambda _model, _data, _t, _q, v: -force * np.tanh(float(way @ v) / soft) * way, also)  # fmt: skip


def _alike(law: str, *names: str, as_word: str) -> tuple[str, tuple[tuple[str, str], ...]]:
    """The site of what two joints share, and what says the same: the word at both, and the law at either."""
    both = "~".join(names)
    return both, ((as_word, both), *((f"coupled_{law}", name) for name in names))
