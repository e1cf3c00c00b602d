"""Candidates that were fitted to a made log: what the tests of further measurements share."""

from dataclasses import replace

import numpy as np

from chladni.gap.explanation.contest import Contest, training_mask
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import band_noise, measured, problem_of, three_bodies

SAMPLES = 4096


def acting(word, site, **values):
    """The hypothesis that an effect acts, starting from these values."""
    count = len(FreeRun(three_bodies(), measured(three_bodies(), band_noise(256))[0]).tunables.names)
    return hypothesis_of((attached(word, site, values),), np.zeros(count))


def wrong(name):
    """The hypothesis that a parameter is far outside its tolerance; without a name, that nothing is missing."""
    start = acting("gain_error", "hammer", gain=1.1).start_z
    return Hypothesis(freed=(name,) if name else (), start_z=start)


def fitted(model, log, floor, *hypotheses):
    """Candidates, best first."""
    run = FreeRun(model, log)
    contest = Contest(run, problem_of(run, floor), training_mask(log.samples, log.sample_rate_hz))
    entered = [contest.enter(one) for one in hypotheses]
    return sorted(entered, key=lambda one: -one.log_evidence)


def contested(effect, *hypotheses, noise=0.02, outputs=None, signals=None, tolerances=None):
    """Arguments of a search: nominal model, a log of the machine with `effect`, and the candidates."""
    model = replace(three_bodies(), tolerances=tolerances or {})
    signals = band_noise(SAMPLES) if signals is None else signals
    log, floor = measured(model.with_effects((effect,)), signals, noise=noise, outputs=outputs)
    return model, log, FreeRun(model, log).tunables, fitted(model, log, floor, *hypotheses), floor


def axis():
    """A carriage on a free guide."""
    return StructureModel(
        name="axis",
        structure=Structure(
            bodies=(Body(name="carriage", mass=10.0),),
            joints=(Joint(name="guide", between=("ground", "carriage"), stiffness=0.0, damping=30.0),),
        ),
        inputs=(StructureInput(name="motor", at="carriage"),),
        outputs=(
            StructureOutput(name="position", measures="displacement", at="carriage"),
            StructureOutput(name="speed", measures="velocity", at="carriage"),
        ),
    )
