"""Entry point of the installed program; imports nothing that takes time before Ctrl-C is understood."""

import sys


def run() -> None:
    """Run ``chladni`` and exit with its code; 130 when interrupted while it still starts."""
    try:
        from chladni.cli.main import main

        code = main()
    except KeyboardInterrupt:
        print("chladni: interrupted", file=sys.stderr)  # noqa: T201
        code = 130
    sys.exit(code)
