"""Where the gap lies, as bars: which site can explain it, which band and regime hold it."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.gap.records.diagnosis import BandShare, Diagnosis
from chladni.signals.engineering import percent, span
from chladni.viewers.figures.sheet import WIDTH_IN, look, paint, plain
from chladni.viewers.gap_evidence import AFTER_ON_LIGHT, GapEvidence
from chladni.viewers.gap_tables import places_of, site_title, sites_named, where_told

Bar = tuple[str, float]

BAR_HEIGHT_IN = 0.19
# On the sheet, where more bars don't tell where to look first; the figure, which stands for a table, has all.
BARS = 10
NAMED, OTHERS = paint(AFTER_ON_LIGHT), "#b9c4cf"


def share_figures(evidence: GapEvidence) -> dict[str, Figure]:
    """Draw the shares of sites, bands and regimes as bars, by name; none without any."""
    parts = [(title, bars) for title, bars in _parts(evidence.found) if bars]
    if not parts:
        return {}
    named = sites_named(evidence.found)
    with look():
        heights = [0.3 + BAR_HEIGHT_IN * len(bars) for _, bars in parts]
        figure = Figure(figsize=(WIDTH_IN, sum(heights) + 0.3), layout="constrained")
        stack = figure.subplots(len(parts), 1, squeeze=False, height_ratios=heights, sharex=True)[:, 0]
        for axes, (title, bars) in zip(stack, parts, strict=True):
            draw_shares(axes, bars, named=named)
            axes.set_title(title, loc="left", pad=2)
        stack[-1].set_xlabel(share_label(evidence.found))
        return {"where": figure}


def share_label(found: Diagnosis) -> str:
    """What the bars are shares of."""
    if found.verdict == "none":
        return "Share of the error [%]"
    return "Share of the gap [%]" if found.left is None else "Share of what the best parameters leave [%]"


def site_bars(found: Diagnosis, *, count: int | None = BARS) -> Sequence[Bar]:
    """Shares that an unknown force at each site explains, the largest first."""
    return [(", ".join(names), share) for names, share in places_of(found.where)[:count]]


def draw_shares(axes: Axes, bars: Sequence[Bar], *, named: set[str]) -> None:
    """Draw bars from top to bottom, those that are named in colour."""
    places = range(len(bars))
    # Sites that can't be told apart share a bar.
    colours = [OTHERS if named.isdisjoint(name.split(", ")) else NAMED for name, _ in bars]
    axes.barh(places, [100 * share for _, share in bars], height=0.7, color=colours)
    for place, (_, share) in enumerate(bars):
        axes.text(100 * share, place, f" {percent(share)}", va="center", fontsize=6.5)
    axes.set_yticks(places, [plain(name) for name, _ in bars], fontsize=7)
    axes.set_ylim(len(bars) - 0.4, -0.6)
    if not bars:
        axes.text(0.5, 0.5, "no place explains anything", transform=axes.transAxes, ha="center", va="center")
    # Room for the number behind a full bar.
    axes.set_xlim(0, 112)
    axes.grid(visible=False, axis="y")


def _parts(found: Diagnosis) -> list[tuple[str, Sequence[Bar]]]:
    where = where_told(found)
    # In the order of frequency, as in a spectrum.
    bands = [(f"{one.low_hz:.4g} to {one.high_hz:.4g} Hz", one.share) for one in sorted(where.bands, key=_low_hz)]
    regimes = sorted(where.regimes, key=lambda one: -one.share)
    return [
        (site_title(found), site_bars(found, count=None)),
        ("In which band it lies" if found.verdict != "none" else "In which band the error lies", bands),
        (
            "While which variable is where",
            [(f"{one.variable} {span(one.low, one.high, one.unit)}", one.share) for one in regimes],
        ),
    ]


def _low_hz(band: BandShare) -> float:
    return band.low_hz
