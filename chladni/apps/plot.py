"""Pictures of every value: on axes of one's own, in a window, in a notebook."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.apps.gap_evidence import gap_evidence
from chladni.gap.records.diagnosis import Diagnosis
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.errors import SetupError
from chladni.signals.value import Drawn
from chladni.spectral.psd import power_spectral_density
from chladni.viewers.figures.gap_shares import draw_shares, share_label, site_bars
from chladni.viewers.figures.gap_sheet import gap_sheet
from chladni.viewers.figures.plot import draw_pictures, pictures
from chladni.viewers.figures.rendering import rendered
from chladni.viewers.gap_tables import sites_named

# Of a notebook: fine enough for a screen, and a third of the size of print.
NOTEBOOK_DOTS_PER_INCH = 150


def plot(value: Drawn, ax: Axes | None = None) -> Axes:
    """Draw any value by matplotlib; the same as ``value.plot(ax)``.

    Parameters
    ----------
    value
        A series, spectra, frequency responses, modes, a diagnosis, ...
    ax
        Axes to draw into; None makes a figure of as many as it takes, with pyplot.

    Returns
    -------
    Axes
        Those drawn into; of several the first, the others are in ``.figure.axes``.

    Raises
    ------
    SetupError
        When the value has no picture, or one that takes more than the one axes given.

    Examples
    --------
    >>> plot(psd("arm.mcap"))  # doctest: +SKIP
    """
    # Windows are pyplot's, and it's asked for only when one is wanted.
    import matplotlib.pyplot as plt

    if isinstance(value, Diagnosis):
        if ax is None:
            return gap_sheet(gap_evidence(value), plt.figure).axes[0]
        draw_shares(ax, site_bars(value), named=sites_named(value))
        ax.set_xlabel(share_label(value))
        return ax
    return draw_pictures(pictures(_drawn(value)), ax=ax, make=plt.figure)


def png(value: Drawn) -> bytes | None:
    """Give the picture of a value as a notebook shows it; None when there is nothing to draw."""
    try:
        figure = gap_sheet(gap_evidence(value)) if isinstance(value, Diagnosis) else _figure(value)
    except SetupError:
        return None
    return rendered(figure, "png", dots_per_inch=NOTEBOOK_DOTS_PER_INCH)


def _figure(value: Drawn) -> Figure:
    figure = draw_pictures(pictures(_drawn(value)), ax=None).figure
    # Axes of a subfigure have that instead.
    assert isinstance(figure, Figure)  # noqa: S101
    return figure


def _drawn(value: Drawn) -> Drawn:
    """Give what is drawn in place of a value: of cross-spectra the powers."""
    return power_spectral_density(value) if isinstance(value, CrossSpectra | AutoSpectra) else value
