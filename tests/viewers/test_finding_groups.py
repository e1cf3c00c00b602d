"""Findings told with short names: nothing is lost, and a name that isn't a path stays as it is."""

from chladni.viewers.finding_groups import told_findings

LABELS = {"/rig/wing.accel.linear.z": "wing.z", "/rig/tail.accel.linear.z": "tail.z"}


def test_channels_have_their_labels_and_topics_lose_what_they_share() -> None:
    told = told_findings(
        [
            "2 channels. No trouble found.",
            "/rig/wing, /rig/tail and 3 more: log time is used",
            "Strongest: 7 Hz (/rig/wing.accel.linear.z and 2 more), 9 Hz (/rig/tail.accel.linear.z).",
            "/rig/clock: was set",
        ],
        LABELS,
    )
    assert told.prefix == "/rig/"
    assert [(group.subject, *group.findings) for group in told.groups] == [
        ("", "2 channels. No trouble found."),
        ("wing, tail and 3 more", "log time is used"),
        ("", "Strongest: 7 Hz (wing.z and 2 more), 9 Hz (tail.z)."),
        ("clock", "was set"),
    ]


def test_findings_on_one_subject_stand_together() -> None:
    told = told_findings(["/a/x: first", "/b/y: other", "/a/x: second"], {})
    assert told.prefix == ""
    assert [(group.subject, group.findings) for group in told.groups] == [
        ("/a/x", ("first", "second")),
        ("/b/y", ("other",)),
    ]


def test_units_and_words_with_slashes_stay() -> None:
    sentences = ("Strongest in m/s^2: 3 Hz.", "and/or: both", "1 (m/s^2)/N")
    told = told_findings(sentences, {"/s": "no"})
    assert tuple(one for group in told.groups for one in group.findings) == sentences


def test_a_sentence_that_begins_with_a_path_and_words_has_no_subject() -> None:
    said = "/a/x drifts against /a/y: name one"
    (group,) = told_findings([said], {}).groups
    assert (group.subject, group.findings) == ("", (said,))
