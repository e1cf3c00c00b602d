"""Feeds damaged and odd files of every kind to their readers: ``python tests/fuzz/all.py --inputs 100000 --seed 7``.

See `harness` for what an input must not do, and each program for the rule of its format.
"""

import sys

from harness import main

FORMATS = ("mcap", "messages", "valid", "csv", "lvm", "uff", "wav", "mat", "npz", "arrow", "tdms", "toml", "blind")

if __name__ == "__main__":
    sys.exit(main(FORMATS))
