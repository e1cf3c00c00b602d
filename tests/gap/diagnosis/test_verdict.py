"""A machine with several ways to go is told over windows where one run from its start goes another one."""

from dataclasses import replace
from itertools import pairwise

import pytest

from chladni.gap.diagnosis.naming import causes_named
from chladni.gap.diagnosis.study import study_of
from chladni.gap.diagnosis.verdict import causes_found
from chladni.gap.records.diagnosis import Candidate
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import band_noise, chain, measured

#: As steep as 1.3e5 N/m, where the joint has 5e4: it may come to rest at several of them.
TEETH = {"amplitude": 20.0, "period": 1e-3, "phase": 0.7}
#: What takes part beside them: a word of each kind would only make it slower.
BESIDE = {"coulomb_friction", "hardening_stiffness", "gain_error"}


def machine():
    """Modes at 21 and 41 Hz; how the first body is displaced is seen, which tells where its teeth are."""
    seen = (
        StructureOutput(name="x0", measures="displacement", at="b0"),
        StructureOutput(name="a1", measures="acceleration", at="b1"),
    )
    return replace(chain([2.0, 1.5], [5e4, 6e4], [12.0, 9.0]), outputs=seen)


@pytest.mark.nightly
@pytest.mark.parametrize("kept", [{"ripple"}, set()])
def test_teeth_that_catch_are_named_over_windows_and_not_without_their_word(kept) -> None:
    toothed = machine().with_effects((attached("ripple", "j0", TEETH),))
    log, _ = measured(toothed, band_noise(3000, rms=60.0), noise=5e-3)
    out = frozenset(CATALOGUE) - BESIDE - kept
    told = []
    study, causes = causes_found(study_of(machine(), log, leave_out=out, own={}), told.append)
    if kept:
        # The hammer's ripple is the joint's with the other sign: the log can't tell which of them it is.
        (group,) = (one.group for one in causes_named(study, causes))
        assert (causes.verdict, {*group}) == ("effect", {"j0", "hammer"})
        assert study.windows is not None
        joint = next(one for one in causes.ranked if one.hypothesis.named == (Candidate(effect="ripple", site="j0"),))
        assert dict(joint.fit.effects[0].values) == pytest.approx(TEETH, rel=0.02)
    else:
        assert causes.verdict == "unknown"
        assert study.windows is None
    assert all(before <= after for before, after in pairwise(told))
    assert told[-1] == 1.0
