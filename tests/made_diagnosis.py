"""Diagnoses made from simulations: a two-jointed arm whose elbow rubs, and variants of what may be said of it."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.signal import spectrogram

from chladni.gap.records.diagnosis import (
    BandShare,
    Candidate,
    Cause,
    ChannelGap,
    Closing,
    Diagnosis,
    DistortionShare,
    FittedNumber,
    GapSignals,
    HeldOut,
    Ranked,
    RegimeShare,
    RestoringForce,
    SiteShare,
    TimeShare,
    Where,
)
from chladni.gap.records.measurement import LogUse
from chladni.models.core.simulation import Simulation
from chladni.models.effects.attached_effect import attached
from chladni.models.files.model_file import load_model
from chladni.models.integrator.simulate import simulate
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ, SECONDS = 500.0, 8.0
FRICTION_N, NOISE = 8.0, 0.01
LOG = "arm.mcap"
MODEL = """format = "chladni.model/1"
name = "arm"
kind = "structure"
[[body]]
name = "column"
mass = 12.0
position = [0.0, 0.0, 0.4]
[[body]]
name = "wrist"
mass = 2.5
position = [0.6, 0.0, 0.8]
[[joint]]
name = "shoulder"
between = ["ground", "column"]
stiffness = 6e4
damping = 400.0
[[joint]]
name = "elbow"
between = ["column", "wrist"]
stiffness = 2e4
damping = 60.0
[[input]]
name = "shaker"
at = "wrist"
channel = "/shaker.wrench.force.x"
[[output]]
name = "acc_column"
measures = "acceleration"
at = "column"
channel = "/column.accel.linear.x"
[[output]]
name = "acc_wrist"
measures = "acceleration"
at = "wrist"
channel = "/wrist.accel.linear.x"
"""


def write_arm_model(folder: Path) -> Path:
    path = folder / "arm.toml"
    path.write_text(MODEL, encoding="utf-8")
    return path


@cache
def arm_model() -> StructureModel:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        model = load_model(write_arm_model(Path(folder)))
    assert isinstance(model, StructureModel)
    return model


@cache
def drive() -> TimeSeries:
    # A slow random force: the elbow slides most of the time, and sticks sometimes.
    rng = np.random.default_rng(5)
    lines = np.arange(4, 240)
    phases = rng.uniform(0, 2 * np.pi, lines.size)
    t = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ
    force = np.cos(2 * np.pi * np.outer(t, lines / SECONDS) + phases).sum(axis=1)
    channel = Channel(name="/shaker.wrench.force.x", unit="N", role="reference")
    return TimeSeries(values=40 * force[None] / force.std(), sample_rate_hz=RATE_HZ, channels=(channel,))


@cache
def nominal_run() -> Simulation:
    return simulate(arm_model(), drive())


@cache
def rubbing_run() -> Simulation:
    rubs = attached("coulomb_friction", "elbow", {"force": FRICTION_N})
    return simulate(arm_model().with_effects([rubs]), drive())


@cache
def measured() -> Real:
    """``[output, sample]`` of the arm that rubs, with 1 % of noise."""
    outputs = rubbing_run().outputs.values
    noise = np.random.default_rng(1).standard_normal(outputs.shape)
    return np.asarray(outputs + NOISE * outputs.std(axis=1, keepdims=True) * noise)


@cache
def log_series() -> TimeSeries:
    """What the arm's log would hold."""
    run = rubbing_run()
    values = np.vstack([run.inputs.values, measured()])
    return replace(run.outputs, values=values, channels=(*run.inputs.channels, *run.outputs.channels))


def pooled(error: Real) -> float:
    """RMS over RMS of the measured, outputs scaled by theirs."""
    return float(np.sqrt(np.mean(np.mean(error**2, axis=1) / np.mean(measured() ** 2, axis=1))))


def gap_map(error: Real) -> tuple[Real, Real, Real]:
    scaled = error / measured().std(axis=1, keepdims=True)
    frequency, time, density = spectrogram(scaled, fs=RATE_HZ, nperseg=256, noverlap=128)
    return time, frequency, np.asarray(density.mean(axis=0).T)


@cache
def signals() -> GapSignals:
    before, after = nominal_run().outputs.values, rubbing_run().outputs.values
    time, frequency, first = gap_map(measured() - before)
    return GapSignals(
        log=LOG,
        sample_rate_hz=RATE_HZ,
        output_names=("acc_column", "acc_wrist"),
        output_units=("m/s^2", "m/s^2"),
        measured=measured(),
        before=before,
        after=after,
        noise_rms=NOISE * after.std(axis=1),
        # White.
        noise_density=np.tile((NOISE * after.std(axis=1, keepdims=True)) ** 2 / (RATE_HZ / 2), 65),
        map_time_s=time,
        map_frequency_hz=frequency,
        gap_map=first,
        gap_map_after=gap_map(measured() - after)[2],
    )


@cache
def restoring_force() -> RestoringForce:
    motion = rubbing_run().motion("elbow")
    noise = 0.4 * np.random.default_rng(2).standard_normal(motion.force.size)
    return RestoringForce(
        site="elbow",
        time_s=np.arange(motion.force.size) / RATE_HZ,
        displacement=motion.displacement,
        velocity=motion.velocity,
        force=motion.force + noise,
        law_force=motion.force,
    )


def friction(**changes: object) -> Cause:
    cause = Cause(
        effect="coulomb_friction",
        site="elbow",
        probability=0.97,
        group=("elbow",),
        alternatives=(),
        parameters={
            "force": FittedNumber(value=8.1, std=0.2, unit="N"),
            "offset": FittedNumber(value=0.02, std=0.05, unit="N"),
            "creep_speed": FittedNumber(value=1e-3, std=None, unit="m/s"),
        },
        variant="regularised",
        share=0.93,
    )
    return replace(cause, **changes)  # type: ignore[arg-type]


@cache
def diagnosis() -> Diagnosis:
    """The elbow rubs, and that is found."""
    run, nominal = rubbing_run().outputs.values, nominal_run().outputs.values
    channels = [
        ChannelGap(name=name, gap=float(np.std(error) / np.std(seen)), noise=NOISE, noise_from="periods")
        for name, error, seen in zip(("acc_column", "acc_wrist"), measured() - nominal, measured(), strict=True)
    ]
    return Diagnosis(
        model="arm",
        logs=(LOG,),
        verdict="effect",
        causes=(friction(),),
        ranking=ranking(),
        where=Where(
            channels=tuple(channels),
            bands=(
                BandShare(low_hz=0.5, high_hz=8.0, share=0.12, noise=0.4),
                BandShare(low_hz=8.0, high_hz=16.0, share=0.71, noise=0.003),
                BandShare(low_hz=16.0, high_hz=30.0, share=0.17),
            ),
            sites=(SiteShare(name="elbow", share=0.93), SiteShare(name="shoulder", share=0.31),
                   SiteShare(name="shaker", share=0.28), SiteShare(name="acc_wrist", share=0.12)),
            regimes=(RegimeShare(variable="elbow.velocity", low=-0.01, high=0.01, share=0.6, unit="m/s", time=0.2),),
            times=(TimeShare(start_s=2.0, end_s=2.5, share=0.31), TimeShare(start_s=0.25, end_s=1.0, share=0.27)),
        ),
        gap=Closing(
            before=pooled(measured() - nominal),
            tuned=0.9 * pooled(measured() - nominal),
            after=1.02 * pooled(measured() - run),
            noise=pooled(measured() - run),
            closed=0.995,
            explained=0.93,
            interval=(0.990, 0.998),
            held_out=(HeldOut(log=LOG, start_s=2.0, end_s=4.0), HeldOut(log=LOG, start_s=6.0, end_s=8.0)),
        ),
        tuned_parameters={
            "elbow.stiffness": FittedNumber(value=20400.0, std=80.0, unit="N/m", nominal=2e4),
            "shoulder.stiffness": FittedNumber(value=60001.0, std=300.0, unit="N/m", nominal=6e4),
            "shoulder.damping": FittedNumber(value=400.0, std=None, unit="N s/m", nominal=400.0),
        },
        next_measurement="Repeat at half the level: hysteresis would then close 12 % less than friction.",
        naive=Candidate(effect="hysteresis", site="elbow"),
        remarks=("shoulder.damping is not determined by this log and was held.",),
        restoring_forces=(restoring_force(),),
        signals=signals(),
        used=(LogUse(log=LOG, used_s=SECONDS, recorded_s=SECONDS, sample_rate_hz=RATE_HZ),),
    )  # fmt: skip


def ranking() -> tuple[Ranked, ...]:
    told: tuple[tuple[str, str, float, float | None, float | None], ...] = (
        ("coulomb_friction", "elbow", 0.97, 0.0102, -123.4),
        ("hysteresis", "elbow", 0.02, 0.031, -130.2),
        ("stribeck_friction", "elbow", 0.006, 0.0103, -131.0),
        ("coulomb_friction", "shoulder", 0.001, 0.24, -160.9),
        ("saturation", "shaker", 0.0005, 0.27, -171.0),
        ("delay", "shaker", 0.0001, None, None),
    )
    return tuple(
        Ranked(effect=effect, site=site, probability=chance, gap=gap, log_evidence=evidence)
        for effect, site, chance, gap, evidence in told
    )


def unknown() -> Diagnosis:
    found = diagnosis()
    gap = replace(found.gap, tuned=0.21, after=0.21, closed=0.2, interval=(0.1, 0.3), explained=None)
    bands = tuple(replace(one, share=share) for one, share in zip(found.where.bands, (0.05, 0.1, 0.85), strict=True))
    return replace(
        found, verdict="unknown", causes=(), gap=gap, advice="Measure the wrist's rotation, too.",
        left=replace(found.where, channels=(), bands=bands),
        restoring_forces=(replace(restoring_force(), law_force=None),),
    )  # fmt: skip


def agreeing() -> Diagnosis:
    found = diagnosis()
    gap = replace(found.gap, before=0.012, tuned=0.0103, after=0.0103, noise=0.0101, closed=None, interval=None)
    gap = replace(gap, explained=None)
    # Nothing acts anywhere; what was looked at, and what was recovered there, is in the record all the same.
    where = replace(found.where, sites=tuple(replace(one, share=0.0) for one in found.where.sites))
    noise = replace(
        restoring_force(), force=restoring_force().force - rubbing_run().motion("elbow").force, law_force=None
    )
    return replace(
        found, verdict="none", causes=(), gap=gap, where=where, next_measurement=None, naive=None,
        restoring_forces=(noise,), ranking=(),
    )  # fmt: skip


def wrong_values() -> Diagnosis:
    found = diagnosis()
    cause = Cause(
        effect="parameter", site="elbow.stiffness", probability=0.96, group=("elbow.stiffness",), alternatives=(),
        parameters={"elbow.stiffness": FittedNumber(value=31000.0, std=90.0, unit="N/m")},
    )  # fmt: skip
    tuned = {"elbow.stiffness": FittedNumber(value=31000.0, std=90.0, unit="N/m", nominal=2e4)}
    gap = replace(found.gap, tuned=found.gap.after, explained=None)
    return replace(found, verdict="parameters", causes=(cause,), tuned_parameters=tuned, gap=gap)


def two_causes() -> Diagnosis:
    gain = Cause(
        effect="gain_error", site="acc_wrist", probability=0.88, group=("acc_wrist",), alternatives=(),
        parameters={"gain": FittedNumber(value=0.924, std=0.011, unit="1")}, share=0.2,
    )  # fmt: skip
    found = diagnosis()
    return replace(found, causes=(friction(share=0.7), gain), gap=replace(found.gap, explained=0.95))


def hidden_floor() -> Diagnosis:
    found = diagnosis()
    floor = Cause(
        effect="base_vibration", site="ground", probability=0.9, group=("ground",), alternatives=(),
        parameters={
            "level": FittedNumber(value=0.31, std=None, unit="m/s^2"),
            "band": FittedNumber(value=40.0, std=None, unit="Hz"),
            "band_start": FittedNumber(value=2.0, std=None, unit="Hz"),
        },
    )  # fmt: skip
    return replace(found, causes=(floor,), gap=replace(found.gap, by="cross_sensor"))


def drifting() -> Diagnosis:
    found = diagnosis()
    return replace(found, gap=replace(found.gap, by="windows", horizon_s=0.5))


def indistinguishable() -> Diagnosis:
    cause = friction(
        group=("elbow", "shoulder"), alternatives=(Candidate(effect="hysteresis", site="elbow"),), probability=0.55
    )
    return replace(diagnosis(), causes=(cause,))


def periodic() -> Diagnosis:
    plain = diagnosis()
    louder = tuple(replace(one, log="louder.mcap") for one in plain.gap.held_out)
    return replace(
        plain,
        distortion=(
            DistortionShare(output="acc_column", linear=0.93, even=0.001, odd=0.068, noise=0.001, nonlinear=0.069),
            DistortionShare(output="acc_wrist", linear=0.88, even=0.002, odd=0.117, noise=0.001, nonlinear=0.119),
        ),
        levels=("From 10 N to 40 N the resonance at 13 Hz falls by 4 %.",),
        elsewhere=(replace(plain.gap, after=0.031, held_out=louder),),
    )


def every_kind() -> dict[str, Diagnosis]:
    """One diagnosis of each kind that a reader may meet."""
    return {
        "effect": diagnosis(),
        "unknown": unknown(),
        "none": agreeing(),
        "parameters": wrong_values(),
        "two": two_causes(),
        "floor": hidden_floor(),
        "windows": drifting(),
        "group": indistinguishable(),
        "periodic": periodic(),
    }
