"""Runs ``python -m chladni``."""

from chladni.cli.entry import run

run()
