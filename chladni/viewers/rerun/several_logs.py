"""Views that several logs share: what each has of one quantity, over one another."""

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb

from chladni.signals.study import Study
from chladni.viewers.groups import Group


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupView:
    """The view of one group of channels, with the end of its axis and the limits of its levels where it has some."""

    group: Group
    view: rrb.View
    end: float
    levels: tuple[float, float] | None = None


def over_one_another(study: Study, drawn: Sequence[GroupView]) -> list[rrb.View]:
    """Give one view for what all logs have of one quantity; those of a single log as they are.

    Parameters
    ----------
    study
        What was drawn.
    drawn
        Its views.
    """
    if not study.logs:
        return [one.view for one in drawn]
    shared: dict[tuple[str, str], list[GroupView]] = {}
    for one in drawn:
        shared.setdefault((one.group.name, one.group.unit), []).append(one)
    return [_merged(some) for some in shared.values()]


def _merged(drawn: Sequence[GroupView]) -> rrb.View:
    """Give the view that reaches farthest, with the curves of all."""
    view = max(drawn, key=lambda one: one.end).view
    view.contents = [f"{one.view.origin}/**" for one in drawn]
    view.origin = "/"
    if levels := [one.levels for one in drawn if one.levels is not None]:
        low, high = zip(*levels, strict=True)
        view.properties["ScalarAxis"] = rrb.ScalarAxis(range=(min(low), max(high)))
    return view
