"""Motion of neighbours relative to each other, mode by mode."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.relative_motion import RelativeMotion
from chladni.signals.study import Study
from chladni.viewers.figures.panes import pages, panes
from chladni.viewers.figures.sheet import look, plain
from chladni.viewers.mode_tables import between, mode_title
from chladni.viewers.style import AMPLITUDES, Style

MODES_IN_A_FIGURE = 8
# The least of very many pairs tell nothing.
PAIRS = 6
# Longer names of pairs leave no room for bars in half a figure, those of longer points in none.
SHORT_NAMES, LONGEST_POINT = 18, 24
BAR_HEIGHT_IN = 0.19
GREATEST, OTHERS = tuple(AMPLITUDES[-1] / 255), "#9fb4c7"


def relative_motion_figures(study: Study) -> dict[str, Figure]:
    """Draw the ratio of each pair of neighbours, the greatest of each mode on top, by name; none without ratios."""
    modes = study.modes
    known = [motion for motion in study.relative_motion if motion.ratio is not None]
    if modes is None or not known:
        return {}
    by_mode = {row: [motion for motion in known if motion.mode == row] for row in range(modes.frequency_hz.size)}
    shown = [row for row, found in by_mode.items() if found]
    style = Style.of(study)
    with look():
        return {
            f"relative motion{part}": _figure(study, [(shown[at], by_mode[shown[at]]) for at in places], style)
            for part, places in pages(len(shown), MODES_IN_A_FIGURE)
        }


def _figure(study: Study, found: Sequence[tuple[int, list[RelativeMotion]]], style: Style) -> Figure:
    bars = min(PAIRS, max(len(motions) for _, motions in found))
    longest = max(
        len(between(motion, style, longest=LONGEST_POINT)) for _, motions in found for motion in motions[:PAIRS]
    )
    columns = 2 if longest <= SHORT_NAMES else 1
    figure, stack = panes(len(found), columns=columns, height_in=0.35 + BAR_HEIGHT_IN * max(bars, 2), sharex=True)
    greatest = max(_end(motion) for _, motions in found for motion in motions) or 1.0
    for axes, (row, motions) in zip(stack, found, strict=True):
        _draw(axes, sorted(motions, key=lambda motion: -(motion.ratio or 0.0)), style)
        axes.set_ylim(bars - 0.4, -0.6)
        axes.set_xlim(0.0, 1.08 * greatest)
        if study.modes is not None:
            axes.set_title(mode_title(study.modes, row), loc="left", pad=2)
    cut = any(len(motions) > PAIRS for _, motions in found)
    rest = f"\nthe {PAIRS} greatest of each mode" if cut else ""
    figure.supxlabel(f"Relative motion over the greatest motion of the mode, ± one sigma{rest}", fontsize=7.5)
    return figure


def _end(motion: RelativeMotion) -> float:
    """Where a bar ends, its sigma included; one that is larger than the bar itself may leave the frame."""
    ratio = motion.ratio or 0.0
    return ratio + min(_sigma(motion), ratio)


def _sigma(motion: RelativeMotion) -> float:
    return motion.ratio_std if motion.ratio_std is not None and np.isfinite(motion.ratio_std) else 0.0


def _draw(axes: Axes, motions: Sequence[RelativeMotion], style: Style) -> None:
    shown = motions[:PAIRS]
    places = np.arange(len(shown))
    ratios = [motion.ratio or 0.0 for motion in shown]
    sigma = [_sigma(motion) for motion in shown]
    colours = [GREATEST] + [OTHERS] * (len(shown) - 1)
    axes.barh(places, ratios, height=0.7, color=colours, xerr=sigma, error_kw={"linewidth": 0.7})
    axes.set_yticks(places, [plain(between(motion, style, longest=LONGEST_POINT)) for motion in shown], fontsize=6.5)
    axes.grid(visible=False, axis="y")
