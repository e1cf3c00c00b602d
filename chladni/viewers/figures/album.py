"""Figures in sections, each drawn once and rendered once in each format, whoever asks for it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Self

from matplotlib.figure import Figure

from chladni.signals.study import Study
from chladni.viewers.figures.cepstrum import cepstrum_figures
from chladni.viewers.figures.complexity import complexity_figures
from chladni.viewers.figures.envelope import envelope_figures
from chladni.viewers.figures.frf import response_figures
from chladni.viewers.figures.levels import level_figures, severity_figures
from chladni.viewers.figures.log_axis import USUAL, Scales
from chladni.viewers.figures.mac import mac_figures
from chladni.viewers.figures.mode_shapes import mode_shape_figures
from chladni.viewers.figures.nyquist import nyquist_figures
from chladni.viewers.figures.octaves import octave_figures
from chladni.viewers.figures.overlay import overlaid_figures
from chladni.viewers.figures.psd import density_figures
from chladni.viewers.figures.relative_motion import relative_motion_figures
from chladni.viewers.figures.rendering import rendered
from chladni.viewers.figures.stabilisation import stabilisation_figures
from chladni.viewers.figures.synthesis import synthesis_figures
from chladni.viewers.figures.waterfall import waterfall_figures
from chladni.viewers.figures.waveforms import waveform_figures


class Album:
    """Figures that are shown in several places, as those of a study in its report and in files.

    Attributes
    ----------
    sections
        Figures by name, by the name of their section.
    """

    def __init__(self, sections: Mapping[str, Mapping[str, Figure]]) -> None:
        self.sections = sections
        self._rendered: dict[tuple[str, str], bytes] = {}

    @classmethod
    def of(cls, study: Study, *, scales: Scales = USUAL) -> Self:
        """Draw every figure that the study has data for: waveforms, spectra, transfer functions, modes.

        `scales` divides the axes of spectra, transfer functions and stabilisation diagrams.
        """
        return cls(
            {
                "waveforms": waveform_figures(study),
                "levels": level_figures(study),
                "severities": severity_figures(study),
                "octaves": octave_figures(study),
                "envelopes": envelope_figures(study),
                "cepstra": cepstrum_figures(study),
                "densities": density_figures(study, scales=scales),
                "responses": response_figures(study, scales=scales),
                "nyquist": nyquist_figures(study),
                "waterfalls": waterfall_figures(study, scales=scales),
                "mode shapes": mode_shape_figures(study),
                "relative motion": relative_motion_figures(study),
                "stabilisation": stabilisation_figures(study, scales=scales),
                "synthesis": synthesis_figures(study, scales=scales),
                "mac": mac_figures(study),
                "complexity": complexity_figures(study),
            }
        )

    @classmethod
    def over_one_another(cls, whole: Study, studies: Sequence[Study], *, scales: Scales = USUAL) -> Self:
        """Draw the spectra and transfer functions of several logs, a curve for each, and what else `whole` has."""
        rest = cls.of(replace(whole, densities=(), response=None), scales=scales)
        return cls({**rest.sections, **overlaid_figures(studies, scales=scales)})

    @classmethod
    def of_change(cls, before: Study, after: Study, changes: Mapping[str, Figure]) -> Self:
        """Draw the spectra of two logs over one another, beside figures of what changed."""
        return cls({"comparison": changes, **overlaid_figures([before, after])})

    @property
    def figures(self) -> dict[str, Figure]:
        """Every figure, by name."""
        return {name: figure for section in self.sections.values() for name, figure in section.items()}

    def rendered(self, name: str, kind: str) -> bytes:
        """Give one figure as ``png``, ``svg`` or ``pdf``."""
        if (name, kind) not in self._rendered:
            self._rendered[name, kind] = rendered(self.figures[name], kind)
        return self._rendered[name, kind]
