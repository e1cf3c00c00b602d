"""Streams of rerun that end with what they were made for: by themselves they last as long as the process.

A recording and a blueprint each have two threads and their buffers. rerun lets go of a recording at the next
``rr.init`` only, and never of a blueprint that was sent (rerun issue 2116); a program that makes many has to ask.
"""

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

from chladni.viewers.rerun.drawing import APPLICATION


def send_blueprint(recording: rr.RecordingStream, blueprint: rrb.Blueprint) -> None:
    """Send a blueprint that is to be used at once, as ``recording.send_blueprint``; its stream ends."""
    native = rerun_bindings.new_blueprint(
        application_id=rr.get_application_id(recording) or APPLICATION,
        make_default=False,
        make_thread_default=False,
        default_enabled=True,
    )
    # As rerun.blueprint.api.create_in_memory_blueprint, which gives nobody the stream to end.
    stream = rr.RecordingStream._from_native(native)  # noqa: SLF001
    stream.set_time("blueprint", sequence=0)
    blueprint._log_to_stream(stream)  # noqa: SLF001
    held = stream.memory_recording()
    rerun_bindings.send_blueprint(held.storage, True, True, recording=recording.to_native())
    stream.disconnect()


def end_unused_streams() -> None:
    """End the streams that nobody holds any more."""
    rerun_bindings.flush_and_cleanup_orphaned_recordings()
