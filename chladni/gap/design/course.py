"""One experiment in simulation: what every candidate predicts, and how far apart they are."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from chladni.gap.calibration import ALONE
from chladni.gap.design.experiment import Experiment
from chladni.gap.design.rival import Part, Prediction, Rival, sums_of
from chladni.gap.plant.free_run import FreeRun, Windows
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Real


class Course:
    """Candidates in one experiment.

    Parameters
    ----------
    experiment
        What is done; its model has all sensors that may be used.
    measurement
        What the experiment's record would be like: names, rate, length.
    windows
        None in free run.

    Raises
    ------
    ModelError
        When a candidate diverges in this experiment: then nobody should try it.
    """

    def __init__(
        self,
        experiment: Experiment,
        rivals: Sequence[Rival],
        measurement: Measurement,
        windows: Windows | None,
    ) -> None:
        self.experiment, self._rivals = experiment, rivals
        self._run = FreeRun(experiment.model, replace(measurement, inputs=experiment.inputs), windows=windows)
        self._kept: dict[tuple[int, int], Real] = {}
        #: Of each candidate.
        self.predictions: list[Prediction] = [one.predicted(self._run, self._initial(one)) for one in rivals]

    def again(self, experiment: Experiment) -> "Course":
        """Give an experiment with the same course, that is averaged or has more sensors."""
        same = copy(self)
        same.experiment = experiment
        return same

    @property
    def outputs(self) -> Real:
        """``[output, sample]`` as the first candidate predicts them."""
        return self.predictions[0].outputs

    def part(
        self,
        noise: NoiseFloor,
        detail: Real,
        chosen: Sequence[int],
        pair: tuple[int, int],
        at: Real | None = None,
    ) -> Part:
        """Give the record of this experiment that one candidate makes and the other imitates.

        Parameters
        ----------
        detail
            ``[output]`` share of an output's power that even the right law would leave.
        chosen
            Rows of the outputs that are measured.
        pair
            Places of the candidate that is true and of the one that imitates it.
        at
            ``[unknown]`` of the one that imitates; as fitted by default.

        Raises
        ------
        ModelError
            When it diverges there.
        """
        rows, gain = list(chosen), float(self.experiment.repeats)
        wanted = self.predictions[pair[0]].outputs
        power = np.mean(noise.whitened(wanted)[rows] ** 2, axis=-1)
        sums = self._sums(noise, pair, at)
        return Part(gain * sums[:, rows], ALONE + gain * detail[rows] * power, wanted.shape[-1])

    def _sums(self, noise: NoiseFloor, pair: tuple[int, int], at: Real | None) -> Real:
        wanted, rival = self.predictions[pair[0]].outputs, self._rivals[pair[1]]
        if at is not None:
            return sums_of(wanted, rival.predicted(self._run, self._initial(rival), at), noise, self._run.windows)
        if pair not in self._kept:
            self._kept[pair] = sums_of(wanted, self.predictions[pair[1]], noise, self._run.windows)
        return self._kept[pair]

    def _initial(self, rival: Rival) -> Real:
        # Of a long log only the first windows are simulated.
        initial = rival.contestant.fit.initial[: len(self._run.windows)]
        return np.asarray(self.experiment.start * initial, dtype=np.float64)
