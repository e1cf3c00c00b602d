"""What limits an answer, beside the answer."""

from types import SimpleNamespace

import numpy as np

from chladni.gap.diagnosis.remarks import remarks_on
from chladni.gap.diagnosis.study import Study
from chladni.gap.plant.free_run import FreeRun
from tests.gap.comparison.test_doubts import EDGE, loop
from tests.gap.made_log import measured, white_floor


def remarks(
    ki: float, *, found_ki: float, undetermined: tuple[str, ...] = (), offsets: tuple[float, ...] = (0.0, 0.0)
) -> tuple[str, ...]:
    """Of a loop whose fit ended at another integral gain."""
    log, _ = measured(loop(0.5 * EDGE), 0.01 * np.sin(np.arange(400) / 50)[None], rate_hz=500.0)
    run = FreeRun(loop(ki), log)
    study = SimpleNamespace(
        model=run.model, measurement=log, contest=SimpleNamespace(run=run), repeating=(), of_constant=None
    )
    study.constants = lambda fit, noise: Study.constants(study, fit, noise)
    off = np.log(found_ki / ki) / run.tunables.tolerance
    z = np.where(np.array(run.tunables.names) == "loop.ki", off, 0.0)
    fit = SimpleNamespace(z=z, effects=(), undetermined=undetermined, offsets=np.array(offsets))
    causes = SimpleNamespace(distorted=(), constants={}, noise=white_floor([1e-6, 1e-6]))
    return remarks_on(study, causes, SimpleNamespace(fit=fit), None)


def test_parameters_that_are_not_told_are_counted_where_not_all_are_named() -> None:
    (few,) = remarks(0.5 * EDGE, found_ki=0.5 * EDGE, undetermined=("a.mass", "b.mass"))
    assert few.startswith("this log doesn't determine a.mass, b.mass: only the stated tolerance")
    (many,) = remarks(0.5 * EDGE, found_ki=0.5 * EDGE, undetermined=tuple("abcdefghi"))
    assert many.startswith("this log doesn't determine a, b, c, d, e, f and 3 more: ")


def test_a_constant_that_gets_no_name_is_told() -> None:
    (told,) = remarks(0.5 * EDGE, found_ki=0.5 * EDGE, offsets=(-2e-6, 0.5e-6))
    assert " is -2 µm beside the model all the time: an offset of the sensor, gravity or a tilt; " in told


def test_a_fit_that_changes_whether_the_model_is_stable_is_told() -> None:
    assert remarks(0.9 * EDGE, found_ki=0.95 * EDGE) == ()
    (unstable,) = remarks(0.9 * EDGE, found_ki=1.1 * EDGE)
    assert unstable.startswith("with the values and effects that were found the model is unstable: a pole at ")
    (stable,) = remarks(1.1 * EDGE, found_ki=0.9 * EDGE)
    assert stable == "with the values and effects that were found the model is stable"
