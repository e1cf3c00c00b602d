"""What the pictures and the report of a simulated log against a measured one need."""

from chladni.apps.gap_comparison import GapComparison, answer
from chladni.apps.gap_evidence import spectra_of, telling_stretch
from chladni.gap.records.diagnosis import GapSignals
from chladni.viewers.gap_evidence import ComparisonEvidence


def comparison_evidence(found: GapComparison) -> ComparisonEvidence:
    """Prepare the pictures of a comparison."""
    signals = _signals(found)
    spectra = spectra_of(signals)
    return ComparisonEvidence(
        simulated=found.simulated,
        answer=answer(found),
        remarks=found.remarks,
        where=found.where,
        distortion=found.distortion,
        simulated_distortion=found.simulated_distortion,
        signals=signals,
        spectra=spectra,
        telling_s=telling_stretch(signals, spectra),
    )


def _signals(found: GapComparison) -> GapSignals:
    measurement, view = found.pair[0], found.view
    # The longer log was cut.
    measured = measurement.outputs[:, : view.residual.shape[1]]
    simulated = measured - view.residual
    return GapSignals(
        log=measurement.log,
        sample_rate_hz=measurement.sample_rate_hz,
        output_names=measurement.output_names,
        output_units=measurement.output_units,
        measured=measured,
        before=simulated,
        # Nothing is tuned: what a diagnosis would leave is what there is.
        after=simulated,
        noise_rms=view.noise.rms,
        noise_density=view.noise.one_sided(measurement.sample_rate_hz),
        map_time_s=view.map_time_s,
        map_frequency_hz=view.map_frequency_hz,
        gap_map=view.map_density,
        gap_map_after=view.map_density,
    )
