"""What was found of a robot, in a sentence a joint; joints that are alike share one."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from chladni.gap.records.diagnosis import PARAMETER, Cause, Diagnosis, FittedNumber, Ranked
from chladni.gap.records.robot import site_words
from chladni.signals.engineering import chance, engineering, percent, span
from chladni.viewers.effect_words import effect_at, effect_heading

#: Clauses that one sentence holds, and joints that one clause joins.
IN_A_SENTENCE, JOINED = 4, 3
#: Numbers that lie so near to each other, of the larger, are alike.
ALIKE = 0.25
#: Joints that are told of a torque that nothing explains.
PLACES = 3
#: Beyond this a word is suggested.
PROBABLE = 0.6


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What is said of a site: verb of one and of several, and text with a slot for each number."""

    verbs: tuple[str, str]
    text: str
    numbers: tuple[FittedNumber, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Clause:
    """All that is said of one site, or of several alike."""

    sites: tuple[str, ...]
    parts: tuple[tuple[Told, ...], ...]
    probability: float

    def sentence(self) -> str:
        """Say it, without a full stop."""
        several = len(self.sites) > 1 or self.sites[0].startswith("all ")
        told = []
        for same in zip(*self.parts, strict=True):
            numbers = [_number(each) for each in zip(*(one.numbers for one in same), strict=True)]
            told.append(f"{same[0].verbs[several]}{same[0].text.format(*numbers)}")
        return f"{listed(self.sites)} {', and '.join(told)} ({chance(self.probability)})"

    def is_like(self, other: "Clause") -> bool:
        """Whether another says the same with nearly the same numbers."""
        ours, theirs = self.parts[0], other.parts[0]
        return [(one.verbs, one.text) for one in ours] == [(one.verbs, one.text) for one in theirs] and all(
            abs(a.value - b.value) <= ALIKE * max(abs(a.value), abs(b.value))
            for one, two in zip(ours, theirs, strict=True)
            for a, b in zip(one.numbers, two.numbers, strict=True)
        )


def robot_sentences(found: Diagnosis) -> Iterator[str]:
    """Say what was found: all of it in one sentence where it's short; else what there is, then a sentence a site."""
    clauses = [one.sentence() for one in _joined(_clauses(_in_order(found)))]
    prefix = "Nothing is missing, but values are wrong: " if found.verdict == "parameters" else ""
    if len(clauses) <= IN_A_SENTENCE:
        yield _begun(f"{prefix}{'; '.join(clauses)}.")
        return
    told = listed(_by_word(found.causes))
    yield f"{prefix or told[0].upper()}{told if prefix else told[1:]}."
    yield from (_begun(f"{one}.") for one in clauses)


def _begun(sentence: str) -> str:
    """Give a sentence its capital; names of joints stay as they are."""
    return f"A{sentence[1:]}" if sentence.startswith("all ") else sentence


def robot_unknown(found: Diagnosis) -> Iterator[str]:
    """Say what pushed, where the torque is missing that no word explains, and what torques alone suggest."""
    gap, where = found.gap, found.where
    yield from map(_pushes, found.causes)
    errs = "torques" if gap.by == "torque" else "simulated positions"
    if gap.tuned > 1.0 and gap.by != "torque":
        yield "Something is missing that no word explains: simulated positions err by more than the motion itself."
    else:
        yield (
            f"Something is missing that no word explains: {errs} err by {percent(gap.tuned)} with the best "
            f"parameters ({percent(gap.before)} before), noise {percent(gap.noise)}."
        )
    shares = sorted(where.sites, key=lambda one: -one.share)[:PLACES]
    if shares:
        told = listed([f"{percent(one.share)} at {one.name}" for one in shares])
        yield f"Of the torque that is missing there is {told}."
    likely = [one for one in found.ranking if one.probability >= PROBABLE]
    if likely:
        yield f"Torques alone suggest {listed(_by_word(likely))}."
    elif found.ranking:
        nearest = [effect_at(one.effect, one.site) for one in found.ranking[:PLACES]]
        yield f"Nearest, but not good enough: {', '.join(nearest)}."


def _pushes(cause: Cause) -> str:
    start, end, torque = (cause.parameters[name] for name in ("start", "end", "torque"))
    where = cause.site if len(cause.group) == 1 else f"{cause.site} or what hangs on it"
    laws = listed([effect_at(one.effect, one.site) for one in cause.alternatives])
    return (
        f"Something pushes {where} from {start.value:.2f} s to {end.value:.2f} s, by up to "
        f"{engineering(torque.value, torque.std, torque.unit)} ({chance(cause.probability)})"
        f"{f'; the log hardly tells it from {laws}' if laws else ''}."
    )


def listed(parts: Sequence[str], *, word: str = "and") -> str:
    """Join as in a sentence."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} {word} {parts[-1]}" if parts else ""


def _in_order(found: Diagnosis) -> list[Cause]:
    """What all share first, then joints and links as they follow one another."""
    robot = None if found.machine is None else found.machine.robot
    joints = () if robot is None else robot.joints
    places = {name: place for place, one in enumerate(joints) for name in (one.name, one.link)}

    def place(cause: Cause) -> float:
        # A pair stands behind its first joint, a wrong value where its joint or link is.
        first, _, second = cause.site.partition("~")
        name = first.rpartition(".")[0] if cause.effect == PARAMETER else first
        return places.get(name, -1) + (0.5 if second else 0.0)

    return sorted(found.causes, key=place)


def _by_word(causes: Sequence[Cause | Ranked]) -> list[str]:
    """Words with their sites, or how many these are."""
    sites: dict[str, list[str]] = {}
    for effect, site in ((one.effect, one.site) for one in causes):
        name, _, value = site.rpartition(".") if effect == PARAMETER else (site, "", "")
        sites.setdefault(f"wrong {value}" if value else effect_heading(effect), []).append(name)
    told = {word: listed(names) if len(names) < JOINED else f"{len(names)} sites" for word, names in sites.items()}
    return [f"{word} at {where}" for word, where in told.items()]


def _clauses(causes: Sequence[Cause]) -> list[Clause]:
    found = []
    for site in dict.fromkeys(_subject(one) for one in causes):
        own = sorted((one for one in causes if _subject(one) == site), key=lambda one: one.effect not in _FRICTION)
        rubs = [one for one in own if one.effect in _FRICTION]
        told = [_rubs(rubs)] if rubs else []
        told += [_WORDS.get(one.effect, _other)(one) for one in own if one.effect not in _FRICTION]
        found.append(Clause(sites=(site,), parts=(tuple(told),), probability=min(one.probability for one in own)))
    return found


def _joined(clauses: Sequence[Clause]) -> list[Clause]:
    """Put sites together that are alike, where there are enough of them to be worth it."""
    groups: list[list[Clause]] = []
    for one in clauses:
        group = next((each for each in groups if all(other.is_like(one) for other in each)), None)
        if group is None:
            groups.append([one])
        else:
            group.append(one)
    found = []
    for group in groups:
        if len(group) < JOINED:
            found += group
            continue
        found.append(
            Clause(
                sites=tuple(site for one in group for site in one.sites),
                parts=tuple(part for one in group for part in one.parts),
                probability=min(one.probability for one in group),
            )
        )
    return found


def _number(same: Sequence[FittedNumber]) -> str:
    if len(same) == 1:
        return engineering(same[0].value, same[0].std, same[0].unit)
    values = [one.value for one in same]
    unit = same[0].unit
    return span(min(values), max(values), "" if unit == "1" else unit)


def _subject(cause: Cause) -> str:
    if cause.effect == "delay" and not cause.site.startswith("all "):
        return f"all commands of {cause.site}"
    if cause.effect == "gravity_tilt":
        return "the base"
    return site_words(cause.site)


#: Friction: what is said of each, with the names of its numbers.
_FRICTION: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "coulomb_friction": ("Coulomb {}", ("force",)),
    "load_friction": ("Coulomb {} and {} of the load", ("force", "coefficient")),
    "stribeck_friction": ("Coulomb {} and {} more at rest", ("force", "rise")),
    "viscous_friction": ("viscous {}", ("coefficient",)),
    "quadratic_damping": ("quadratic {}", ("coefficient",)),
}


#: What is said of Coulomb friction that changes along a joint's way.
_UNEVEN = ("Coulomb {} midway, {} at its lowest and {} at its highest position", ("force", "at_lowest", "at_highest"))


def _friction(cause: Cause) -> tuple[str, tuple[str, ...]]:
    return _UNEVEN if "at_lowest" in cause.parameters else _FRICTION[cause.effect]


def _rubs(causes: Sequence[Cause]) -> Told:
    ordered = sorted(causes, key=lambda one: list(_FRICTION).index(one.effect))
    texts = [_friction(one)[0] for one in ordered]
    numbers = [one.parameters[name] for one in ordered for name in _friction(one)[1]]
    return Told(verbs=("rubs", "rub"), text=f": {', '.join(texts)}", numbers=tuple(numbers))


def _says(one: str, several: str, text: str, *names: str) -> Callable[[Cause], Told]:
    def told(cause: Cause) -> Told:
        return Told(verbs=(one, several), text=text, numbers=tuple(cause.parameters[name] for name in names))

    return told


def _against(one: str, several: str, text: str, name: str) -> Callable[[Cause], Told]:
    """Say a number beside what the description has."""

    def told(cause: Cause) -> Told:
        number = cause.parameters[name]
        described = ""
        if number.nominal:
            described = f" where the description has {engineering(number.nominal, None, number.unit)}"
        return Told(verbs=(one, several), text=f"{text}{described}", numbers=(number,))

    return told


def _spring(cause: Cause) -> Told:
    if "ratio" not in cause.parameters:
        return _says("has", "have", " a spring of {} about {}", "stiffness", "rest")(cause)
    first, second = cause.site.split("~")
    text = f" a spring of {{}} over {first} and {{}} times {second}, at rest at {{}}"
    return _says("has", "have", text, "stiffness", "ratio", "rest")(cause)


def _other(cause: Cause) -> Told:
    """Say a word that nothing else is known of by its name and its numbers."""
    names = [f"{name.replace('_', ' ')} {{}}" for name in cause.parameters]
    numbers = f" ({', '.join(names)})" if names else ""
    return Told(
        verbs=("has", "have"),
        text=f" {effect_heading(cause.effect)}{numbers}",
        numbers=tuple(cause.parameters.values()),
    )


_WORDS: Mapping[str, Callable[[Cause], Told]] = {
    PARAMETER: _against("is", "are", " {}", "value"),
    "armature": _against("has", "have", " an armature of {}", "inertia"),
    "delay": _says("arrive", "arrive", " {} late", "delay"),
    "payload": _says("carries", "carry", " {} more", "mass"),
    "gain_error": _says("gives", "give", " {} of the torque that is asked", "gain"),
    "controller_gain": _says("has", "have", " {} of the believed kp and {} of the kd", "kp", "kd"),
    "encoder_offset": _says("reads", "read", " {} too much", "offset"),
    "gravity_tilt": _says("is", "are", " tilted by {} about x and {} about y", "about_x", "about_y"),
    "joint_spring": _spring,
    "lag": _says("follows", "follow", " with a lag of {}", "time_constant"),
    "saturation": _says("gives", "give", " no more than {}", "limit"),
}
