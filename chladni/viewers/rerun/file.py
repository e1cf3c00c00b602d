"""A study written to a rerun file."""

import os
from pathlib import Path

import rerun as rr

from chladni.io.atomic import atomic_write
from chladni.signals.study import Study
from chladni.viewers.rerun.drawing import draw, new_recording


def write_rrd(study: Study, path: str | os.PathLike[str]) -> Path:
    """Write a study to a ``.rrd`` file, whole or not at all.

    Parameters
    ----------
    study
        What to draw.
    path
        File to write; one that exists is replaced once the new one is complete.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    LogError
        When the folder doesn't exist, or the operating system refuses the write.
    """
    target = Path(path)
    recording = new_recording()
    # Not rerun's own file sink: on a full disk it only logs the loss, and a later flush waits for ever.
    stream = rr.binary_stream(recording)
    with atomic_write(target) as file:
        # Inside: a folder that can't be written to is told before the work, not after.
        draw(recording, study)
        file.write(stream.read() or b"")
    return target
