"""What causes the gap: the fit that is believed, and the verdict."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from chladni.gap.calibration import NAMED, SOME
from chladni.gap.diagnosis.belief import Belief
from chladni.gap.diagnosis.finer_floor import finer_floor, share_of_own_signal
from chladni.gap.diagnosis.plausible import is_lost
from chladni.gap.diagnosis.search import Search
from chladni.gap.diagnosis.shaken_ground import ShakenGround, shaken_by
from chladni.gap.diagnosis.study import Study, over_floor, over_model, over_windows, step_error
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.location.locate import Located
from chladni.gap.records.diagnosis import Verdict
from chladni.gap.records.noise_floor import NoiseFloor

Step = Callable[[float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Causes:
    """What the search says.

    Attributes
    ----------
    verdict
        See `Diagnosis`.
    tuned
        The contestant without any cause.
    best
        The one that is believed; `tuned` when none pays.
    belief
        Probabilities of all.
    shaken
        The ground when the floor shakes, with the places that can't be told from it, else None.
    noise
        The floor, lowered to what `best` leaves of it where that is less.
    distorted
        Outputs whose residual, when nothing is named, follows their own signal in a curve.
    forces
        Unknown forces at two places that explain much more than one anywhere, when pairs were looked for; else None.
    within_step
        Whether the best causes do less than the own step of a simulator that isn't ours.
    constants
        Outputs whose constant is all that is missing, with it.
    """

    verdict: Verdict
    tuned: Contestant
    best: Contestant
    belief: Belief
    shaken: ShakenGround | None
    noise: NoiseFloor
    distorted: tuple[str, ...]
    forces: Located | None = None
    within_step: bool = False
    constants: Mapping[str, float] = field(default_factory=dict)

    @property
    def ranked(self) -> tuple[Contestant, ...]:
        """The best fit of each set of causes, by falling probability."""
        return tuple(one.best for one in self.belief.sets if one.causes)


def causes_found(study: Study, progress: Step) -> tuple[Study, Causes]:
    """Search and judge; also give the study that the answer is of, over another floor or over windows."""
    search = searched(study, progress)
    return search.study, judged(search)


def searched(study: Study, progress: Step) -> Search:
    """Search over the floor that was estimated, over a finer one, and over windows where a run can't follow."""
    progress = _rising(progress)
    search = Search(study)
    search.run(_part(progress, 0.0, 0.6))
    if study.model is not study.stated and _verdict(search.belief) == "unknown":
        # The hold was told beside an unknown force, and none that has a name goes with it.
        stated = Search(over_model(study, study.stated))
        stated.run(_part(progress, 0.6, 0.7))
        search = search if _verdict(stated.belief) == "unknown" else stated
    finer = finer_floor(search.study, search.best)
    if finer is not None:
        # Behind what was found noise turns out lower than it was estimated: what was taken for it is another cause.
        search = search.over(over_floor(search.study, finer))
        go_on = search.go_on if search.best.hypothesis.effects else search.run
        go_on(_part(progress, 0.7, 0.85))
    if _parted(search):
        # A machine that may take several ways goes one that a model of almost the same numbers doesn't: a law that
        # follows over short windows from the states that an unknown force led through is judged over windows.
        windows = Search(over_windows(search.study, search.states)) if search.states is not None else search
        windows.begin(_part(progress, 0.85, 1.0))
        search = windows if _verdict(windows.belief) == "effect" else search
    progress(1.0)
    return search


def _rising(progress: Step) -> Step:
    """Tell nothing less than was told before: a search begins its rounds again."""
    told = 0.0

    def tell(done: float) -> None:
        nonlocal told
        told = max(told, done)
        progress(told)

    return tell


def _part(progress: Step, start: float, stop: float) -> Step:
    return lambda done: progress(start + (stop - start) * done)


def _parted(search: Search) -> bool:
    """Whether nothing is named since runs part from the log's."""
    unknown = _verdict(search.belief) == "unknown"
    lost = search.study.windows is None and is_lost(search.study.location, search.best.chi)
    return unknown and lost and search.states is not None


def judged(search: Search) -> Causes:
    """Give the verdict on what was found."""
    study, belief, tuned, best = search.study, search.belief, search.nothing, search.best
    verdict = _verdict(belief)
    within_step = verdict == "effect" and _within_step(study, tuned, best)
    verdict = "unknown" if within_step else verdict
    shaken = shaken_by(study, tuned) if verdict == "unknown" else None
    if shaken is not None or (verdict == "none" and study.lattices):
        verdict = "effect"
    distorted = _distorted(study, tuned) if verdict in ("none", "unknown") else ()
    if verdict == "none" and (study.repeating or distorted):
        # A sensor that holds its samples moves nothing, and looks like noise; but it's no noise.
        verdict = "unknown"
    noise = study.contest.noise.lowered(best.held)
    alone = shaken is None and best is tuned and verdict in ("none", "effect")
    constants = study.constants(tuned.fit, noise) if alone and study.of_constant is not None else {}
    verdict = "effect" if constants else verdict

    # Only of what will be told: it costs as much as a step of a fit.
    told = study.contest.with_spread(best)
    return Causes(
        verdict=verdict,
        tuned=told if best is tuned else study.contest.with_spread(tuned),
        best=told,
        belief=belief,
        shaken=shaken,
        noise=noise,
        distorted=distorted,
        within_step=within_step,
        constants=constants,
        forces=search.forces,
    )


def _within_step(study: Study, tuned: Contestant, best: Contestant) -> bool:
    error = step_error(study, best.fit)
    return error is not None and error > tuned.gap - best.gap


def _verdict(belief: Belief) -> Verdict:
    first = belief.sets[0]
    if not first.causes:
        return "none" if first.probability > belief.unknown else "unknown"
    if not any(belief.probability(*belief.alike(one)) >= NAMED for one in first.causes):
        return "unknown"
    return "effect" if first.best.hypothesis.effects else "parameters"


def _distorted(study: Study, tuned: Contestant) -> tuple[str, ...]:
    simulated = tuned.fit.outputs[:, study.held]
    shares = share_of_own_signal(simulated, study.measurement.outputs[:, study.held] - simulated)
    return tuple(name for name, share in zip(study.measurement.output_names, shares, strict=True) if share > SOME)
