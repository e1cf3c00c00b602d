"""Figures of a diagnosis: what they draw is what was found."""

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from chladni.apps.gap_evidence import gap_evidence
from chladni.gap.records.diagnosis import FittedNumber
from chladni.signals.engineering import axis_scale
from chladni.signals.errors import EstimateError
from chladni.viewers.figures.campaign import ReliabilityBin, calibration_figure, confusion_figure
from chladni.viewers.figures.gap import gap_album
from chladni.viewers.figures.gap_sheet import LETTERS, LIMIT_LETTERS, SENTENCES, gap_sheet
from chladni.viewers.figures.rendering import rendered
from chladni.viewers.figures.restoring_force import _draw_over_time
from chladni.viewers.gap_band import band_told, shown_hz
from chladni.viewers.gap_evidence import GapEvidence
from chladni.viewers.gap_summary import caveats, summary
from chladni.viewers.restoring_force import POINTS, SIGNED, force_range, motion_name, signed_colours, spread_out
from tests import made_diagnosis as made


@pytest.fixture(scope="module")
def evidence() -> GapEvidence:
    return gap_evidence(made.diagnosis())


@pytest.fixture(scope="module")
def figures(evidence: GapEvidence) -> dict[str, Figure]:
    return gap_album(evidence).figures


def test_there_is_a_figure_of_everything_that_was_found(figures: dict[str, Figure]) -> None:
    assert set(figures) == {"signals", "errors", "spectra", "gap map", "restoring force", "where"}


def test_signals_are_those_of_the_telling_stretch(figures: dict[str, Figure], evidence: GapEvidence) -> None:
    signals, telling_s = made.signals(), evidence.telling_s
    assert telling_s is not None
    first, last = (round(end * made.RATE_HZ) for end in telling_s)
    for row, axes in enumerate(figures["signals"].axes):
        assert [line.get_label() for line in axes.lines] == ["measured", "simulated before", "after"]
        for line, values in zip(axes.lines, (signals.measured, signals.before, signals.after), strict=True):
            np.testing.assert_array_equal(line.get_ydata(), values[row, first:last])
        assert axes.get_title(loc="left") == signals.output_names[row]


def test_a_map_without_colours_says_that_all_is_below_its_scale() -> None:
    signals = made.signals()
    quiet = replace(signals, gap_map_after=1e-9 * signals.gap_map)
    before, after = gap_album(gap_evidence(replace(made.diagnosis(), signals=quiet))).figures["gap map"].axes[:2]
    low = before.images[0].get_clim()[0]
    assert after.get_title(loc="left") == f"Gap after · all of it below {low:.0f} dB"
    assert "below" not in before.get_title(loc="left")


def test_small_signals_and_errors_have_a_prefix_on_their_axes() -> None:
    signals = made.signals()
    small = replace(
        signals, output_units=("m", "m"), measured=1e-5 * signals.measured, before=1e-5 * signals.before,
        after=1e-5 * signals.after, noise_rms=1e-5 * signals.noise_rms,
    )  # fmt: skip
    drawn = gap_album(gap_evidence(replace(made.diagnosis(), signals=small))).figures
    for name in ("signals", "errors"):
        for axes in drawn[name].axes:
            assert axes.get_ylabel() == "[µm]"
            largest = max(float(np.nanmax(np.abs(line.get_ydata()))) for line in axes.lines)
            assert 1.0 <= largest < 1000.0


def test_errors_keep_their_extremes(figures: dict[str, Figure]) -> None:
    before = made.measured() - made.nominal_run().outputs.values
    for row, axes in enumerate(figures["errors"].axes):
        drawn = np.asarray(axes.lines[0].get_ydata())
        assert (drawn.max(), drawn.min()) == (before[row].max(), before[row].min())


def test_spectra_are_roots_of_densities(figures: dict[str, Figure], evidence: GapEvidence) -> None:
    assert evidence.spectra is not None
    axes = figures["spectra"].axes[1]
    low, high = (int(np.searchsorted(evidence.spectra.frequency_hz, end)) for end in axes.get_xlim())
    np.testing.assert_allclose(axes.lines[1].get_ydata(), np.sqrt(evidence.spectra.before[1, low : high + 1]))
    # Nearly all of each curve's power is there; from standing still no logarithmic axis of frequency begins.
    assert low == 1
    assert evidence.spectra.before[1, low : high + 1].sum() > 0.99 * evidence.spectra.before[1, 1:].sum()
    noise = np.sqrt(evidence.spectra.noise[1, low : high + 1])
    np.testing.assert_allclose(axes.lines[3].get_ydata(), noise)
    assert axes.get_ylim()[0] < noise.min()


def test_noise_has_its_own_spectrum() -> None:
    signals, rate_hz = made.signals(), made.RATE_HZ
    # Of noise that fades with frequency a level line of the same RMS lay above all that was measured there.
    hz = np.linspace(0, rate_hz / 2, signals.noise_density.shape[1])
    fading = signals.noise_density * 10 ** (-4 * hz / hz[-1])
    evidence = gap_evidence(replace(made.diagnosis(), signals=replace(signals, noise_density=fading)))
    assert evidence.spectra is not None
    np.testing.assert_allclose(
        evidence.spectra.noise,
        signals.noise_density[:, :1] * 10 ** (-4 * evidence.spectra.frequency_hz / hz[-1]),
        # Straight lines between logarithms that fall by a sixteenth of a decade.
        rtol=0.01,
    )
    (line,) = (line for line in gap_album(evidence).figures["spectra"].axes[0].lines if line.get_label() == "noise")
    assert line.get_ydata()[-1] < line.get_ydata()[0]


def test_both_maps_have_one_scale_of_colours(figures: dict[str, Figure]) -> None:
    before, after = (axes.images[0] for axes in figures["gap map"].axes[:2])
    assert before.get_clim() == after.get_clim()
    top = figures["gap map"].axes[0]
    assert top.get_ylim() == (0, shown_hz(made.signals()))
    assert top.get_title(loc="left") == f"Gap before · {band_told(made.signals())}"
    assert before.get_array().max() == pytest.approx(10 * np.log10(made.signals().gap_map.max()))


def test_where_an_estimate_rings_at_the_end_of_a_record_the_rest_is_still_seen() -> None:
    surface = made.restoring_force()
    high = force_range(surface)[1]
    force = surface.force.copy()
    force[-1] = 1e3 * high
    axes = Figure().add_subplot()
    _draw_over_time(axes, replace(surface, force=force), None)
    scale, unit = axis_scale(force, surface.force_unit)
    np.testing.assert_allclose(np.array(axes.get_ylim()) * scale, force_range(replace(surface, force=force)))
    assert max(axes.get_ylim()) * scale < 5 * high
    assert [one.get_text() for one in axes.texts] == [
        f"recovered: up to {force[-1] / scale:.2g} {unit} beyond the axis"
    ]


def test_the_force_is_drawn_over_both_motions_with_the_law(figures: dict[str, Figure]) -> None:
    surface = made.restoring_force()
    rows = spread_out(surface)
    named = {axes.get_xlabel().split(" [")[0]: axes for axes in figures["restoring force"].axes}
    over_displacement, over_velocity, over_time = (named[name] for name in ("Displacement", "Velocity", "Time"))
    # In the telling stretch nothing is cut.
    low, high = over_time.get_ylim()
    assert not over_time.texts
    assert low < min(line.get_ydata().min() for line in over_time.lines)
    assert high > max(line.get_ydata().max() for line in over_time.lines)
    dots = np.asarray(over_velocity.collections[0].get_offsets())
    np.testing.assert_allclose(dots[:, 0], surface.velocity[rows])
    np.testing.assert_allclose(dots[:, 1], surface.force[rows])
    assert "[mm]" in over_displacement.get_xlabel()
    np.testing.assert_allclose(
        np.asarray(over_displacement.collections[0].get_offsets())[:, 0], 1e3 * surface.displacement[rows]
    )
    assert surface.law_force is not None
    np.testing.assert_allclose(over_velocity.lines[0].get_ydata(), surface.law_force[rows])
    assert [line.get_label() for line in over_time.lines] == ["recovered", "law"]
    shown = np.isin(surface.time_s, over_time.lines[1].get_xdata())
    np.testing.assert_array_equal(over_time.lines[1].get_ydata(), surface.law_force[shown])


def test_bars_are_the_shares_and_the_named_site_is_in_colour(figures: dict[str, Figure]) -> None:
    bars = figures["where"].axes[0].patches
    assert [bar.get_width() for bar in bars] == pytest.approx([93, 31, 28, 12])
    colours = [bar.get_facecolor() for bar in bars]
    assert colours[0] != colours[1] == colours[2]
    wrong = gap_album(gap_evidence(made.wrong_values())).figures["where"].axes[0].patches
    assert [bar.get_facecolor() for bar in wrong][:2] == colours[:2]


def test_one_output_has_room_for_its_curves() -> None:
    signals = made.signals()
    alone = replace(
        signals,
        output_names=signals.output_names[:1],
        output_units=signals.output_units[:1],
        **{
            name: getattr(signals, name)[:1] for name in ("measured", "before", "after", "noise_rms", "noise_density")
        },
    )
    drawn = gap_album(gap_evidence(replace(made.diagnosis(), signals=alone))).figures
    for name in ("signals", "errors", "spectra"):
        figure = drawn[name]
        figure.draw_without_rendering()
        height_in = figure.axes[0].get_position().height * figure.get_size_inches()[1]
        assert height_in > 1.2
        # Numbers of the axis have twice the room of their letters.
        axis = figure.axes[0].yaxis
        shown = [one for one in axis.get_majorticklabels() if one.get_text()]
        assert len(shown) * 2 * axis.get_majorticklabels()[0].get_fontsize() < 72 * height_in


def test_windows_are_told_and_not_joined() -> None:
    signals = made.signals()
    starts = tuple(range(0, signals.measured.shape[1], 250))
    evidence = gap_evidence(replace(made.drifting(), signals=replace(signals, window_starts=starts)))
    drawn = gap_album(evidence).figures
    for name in ("signals", "errors", "spectra"):
        assert drawn[name].axes[0].get_title(loc="right") == "windows of 0.5 s"
    errors = np.asarray(drawn["errors"].axes[0].lines[0].get_ydata())
    assert np.isnan(errors).sum() == len(starts) - 1
    assert not np.isnan(np.asarray(drawn["signals"].axes[0].lines[0].get_ydata())).any()


def test_where_nothing_is_named_the_last_simulation_is_the_tuned_one() -> None:
    drawn = gap_album(gap_evidence(made.unknown())).figures
    labels = [line.get_label() for line in drawn["signals"].axes[0].lines]
    assert labels == ["measured", "simulated before", "when tuned"]
    shares = drawn["where"].axes
    assert shares[-1].get_xlabel() == "Share of what the best parameters leave [%]"
    assert [bar.get_width() for bar in shares[1].patches] == pytest.approx([5, 10, 85])


def test_a_motion_without_a_mean_says_so() -> None:
    surface = made.restoring_force()
    assert motion_name(surface, "velocity") == "Velocity"
    assert motion_name(surface, "displacement") == "Displacement"
    centred = replace(surface, displacement=surface.displacement - surface.displacement.mean())
    assert motion_name(centred, "displacement") == "Displacement from its mean"


def test_the_rare_ends_of_a_law_are_shown() -> None:
    surface = made.restoring_force()
    assert surface.law_force is not None
    law = surface.law_force.copy()
    drawn = spread_out(surface)[100]
    law[drawn] = 50 * np.abs(law).max()
    assert force_range(replace(surface, law_force=law))[1] > law[drawn]


def test_no_line_of_the_title_breaks_inside_a_quantity() -> None:
    stribeck = made.friction(
        effect="stribeck_friction",
        variant=None,
        parameters={
            name: FittedNumber(value=value, std=std, unit=unit)
            for name, value, std, unit in (
                ("coulomb", 13.2, 1.1, "N"), ("static", 123.8, 1.4, "N"), ("speed", 0.0779, 0.0065, "m/s"),
            )
        },
    )  # fmt: skip
    for probability in (0.71, 0.97):
        found = replace(made.diagnosis(), causes=(replace(stribeck, probability=probability),))
        lines = gap_sheet(gap_evidence(found)).get_suptitle().splitlines()
        assert not any(re.match(r"±|%|m?N\b|mm/s", line) or line.endswith("±") for line in lines)


def test_the_figure_of_shares_leaves_no_site_out() -> None:
    found = made.diagnosis()
    sites = tuple(replace(found.where.sites[0], name=f"joint{row}", share=0.9 - 0.03 * row) for row in range(23))
    many = gap_evidence(replace(found, where=replace(found.where, sites=sites)))
    assert len(gap_album(many).figures["where"].axes[0].patches) == 23
    assert len(gap_sheet(many).axes[-1].patches) == 10


def test_many_outputs_are_divided_over_figures() -> None:
    signals, several = made.signals(), 6
    wide = replace(
        signals,
        output_names=tuple(f"out_{row}" for row in range(several)),
        output_units=("m/s^2",) * several,
        **{name: np.repeat(getattr(signals, name)[:1], several, axis=0) for name in ("measured", "before", "after")},
        noise_rms=np.repeat(signals.noise_rms[:1], several),
        noise_density=np.repeat(signals.noise_density[:1], several, axis=0),
    )
    drawn = gap_album(gap_evidence(replace(made.diagnosis(), signals=wide))).figures
    assert {"signals 1–3", "signals 4–6", "spectra 1–3"} <= set(drawn)


@pytest.mark.parametrize("kind", made.every_kind())
def test_a_sheet_can_be_drawn_of_every_answer(kind: str) -> None:
    found = made.every_kind()[kind]
    sheet = gap_sheet(gap_evidence(found))
    title, limits = sheet.get_suptitle(), sheet.get_supxlabel()
    first = summary(found)[:SENTENCES]
    assert title.replace("\n", " ") == " ".join([*first, *(one for one in caveats(found) if one not in first)])
    assert max(map(len, title.splitlines())) <= LETTERS
    assert limits.replace("\n", " ") == " ".join(f"– {one}" for one in (*found.levels, *found.remarks))
    assert max(map(len, limits.splitlines())) <= LIMIT_LETTERS


def test_the_sheet_alone_does_not_look_like_success() -> None:
    found = made.periodic()
    short = "the log is short: 300 samples, 1000 or more tell more"
    worse = replace(found.elsewhere[0], before=0.52, after=0.71)
    sheet = gap_sheet(gap_evidence(replace(found, elsewhere=(worse,), remarks=(short, *found.remarks))))
    title = sheet.get_suptitle().replace("\n", " ")
    assert "the error goes from 52 % to 71 %, noise 1.0 %: what was found doesn't carry over." in title
    limits = sheet.get_supxlabel()
    for one in (short, *found.levels, *found.remarks):
        assert one in limits.replace("\n", " ")
    sheet.draw_without_rendering()
    # Neither text runs over the edge or into a picture.
    size, shown = sheet.bbox, {one.get_text(): one for one in sheet.texts}
    above, below = (shown[text].get_window_extent() for text in (sheet.get_suptitle(), limits))
    axes = [one.get_tightbbox() for one in sheet.axes]
    assert size.y1 >= above.y1 > above.y0 >= max(one.y1 for one in axes)
    assert min(one.y0 for one in axes) >= below.y1 > below.y0 >= size.y0
    assert max(above.x1, below.x1) <= size.x1


def test_a_diagnosis_without_signals_still_has_its_bars() -> None:
    bare = replace(made.diagnosis(), signals=None, restoring_forces=())
    assert set(gap_album(gap_evidence(bare)).figures) == {"where"}
    assert len(gap_sheet(gap_evidence(bare)).axes) == 1


def test_without_shares_of_sites_the_other_bars_are_drawn() -> None:
    where = replace(made.diagnosis().where, sites=())
    one_sensor = gap_evidence(replace(made.diagnosis(), where=where))
    titles = [axes.get_title(loc="left") for axes in gap_album(one_sensor).figures["where"].axes]
    assert titles == ["In which band it lies", "While which variable is where"]
    assert not any("site" in axes.get_title(loc="left") for axes in gap_sheet(one_sensor).axes)


def test_where_nothing_is_missing_no_picture_says_that_something_is() -> None:
    evidence = gap_evidence(made.agreeing())
    drawn = gap_album(evidence).figures
    force = drawn["restoring force"].get_suptitle()
    assert force == "Force recovered at elbow: nothing is missing, this is noise and what tuning moved"
    # Bars of zeros would look like a place.
    axes = drawn["where"].axes
    assert [one.get_title(loc="left") for one in axes] == [
        "In which band the error lies", "While which variable is where"
    ]  # fmt: skip
    assert axes[-1].get_xlabel() == "Share of the error [%]"
    assert [one.get_xlabel() for one in gap_sheet(evidence).axes] == ["Time [s]", "Frequency [Hz]"]
    lacking = gap_album(gap_evidence(made.unknown())).figures["restoring force"].get_suptitle()
    assert lacking == "Force that the model lacks at elbow"


def test_nothing_at_all_is_drawn_as_nothing() -> None:
    where = replace(made.diagnosis().where, sites=(), bands=(), regimes=())
    bare = replace(made.diagnosis(), signals=None, restoring_forces=(), where=where)
    assert gap_album(gap_evidence(bare)).figures == {}


@pytest.mark.nightly
def test_the_sheet_is_the_same_bytes_every_time(evidence: GapEvidence) -> None:
    assert rendered(gap_sheet(evidence), "png") == rendered(gap_sheet(evidence), "png")


def test_a_name_with_markup_is_drawn_as_it_is() -> None:
    signals = replace(made.signals(), output_names=("$a_b$", "\u9b3c_<b>"))
    drawn = gap_album(gap_evidence(replace(made.diagnosis(), signals=signals)))
    assert b"<svg" in drawn.rendered("signals", "svg")


def test_surfaces_are_drawn_evenly_and_in_range() -> None:
    surface = made.restoring_force()
    rows = spread_out(surface)
    assert rows.size == POINTS
    assert (rows[0], rows[-1]) == (0, surface.force.size - 1)
    low, high = force_range(surface)
    assert low == -high
    assert high > np.percentile(np.abs(surface.force), 99)
    silent = replace(surface, force=np.zeros(3), displacement=np.zeros(3), velocity=np.zeros(3), law_force=None)
    assert force_range(silent)[1] > 0


def test_colours_run_from_blue_over_grey_to_orange() -> None:
    np.testing.assert_array_equal(signed_colours(np.array([-2.0, 0.0, 1.0])), SIGNED.astype(np.uint8))


BINS = (
    ReliabilityBin(low=0.5, high=0.6, said=0.55, right=0.5, interval=(0.3, 0.7), cases=10),
    ReliabilityBin(low=0.6, high=0.7, said=0.0, right=0.0, interval=(0.0, 1.0), cases=0),
    ReliabilityBin(low=0.9, high=1.0, said=0.97, right=1.0, interval=(0.93, 1.0), cases=50),
)


def test_the_reliability_diagram_shows_what_was_said_against_what_was_right() -> None:
    figure = calibration_figure(BINS, error=0.031)
    reliability, counts = figure.axes
    (points,) = (line for line in reliability.lines if line.get_marker() == "o")
    # An empty bin says nothing.
    np.testing.assert_array_equal(points.get_xdata(), [0.55, 0.97])
    np.testing.assert_array_equal(points.get_ydata(), [0.5, 1.0])
    assert [bar.get_height() for bar in counts.patches] == [10, 50]
    assert "0.031" in reliability.get_title(loc="left")
    assert b"<svg" in rendered(figure, "svg")


def test_the_confusion_matrix_is_blue_where_it_is_right_and_orange_where_not() -> None:
    words = ["delay", "lag"]
    figure = confusion_figure(np.array([[9, 1, 0], [0, 5, 2]]), truths=words, answers=[*words, "unknown"])
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.texts] == ["9", "1", "5", "2"]
    colours = axes.images[0].get_array()
    blue, orange, white = colours[0, 0], colours[0, 1], colours[0, 2]
    assert blue[2] > blue[0]
    assert orange[0] > orange[2]
    np.testing.assert_array_equal(white, 1.0)
    with pytest.raises(EstimateError, match="counts of shape"):
        confusion_figure(np.zeros((2, 2), dtype=np.int64), truths=words, answers=["delay"])


def test_of_two_forces_both_are_drawn() -> None:
    first = made.restoring_force()
    both = gap_evidence(replace(made.two_causes(), restoring_forces=(first, replace(first, site="shoulder"))))
    drawn = gap_album(both).figures
    assert {"restoring force at elbow", "restoring force at shoulder"} < set(drawn)
    labels = {axes.get_ylabel() for axes in gap_sheet(both).axes}
    assert {"Force at elbow [N]", "Force at shoulder [N]"} < labels
