"""Runs ``python -m chladni``."""

from chladni.cli.main import run

run()
