"""Programs, which are run, not collected; the tests are those of their harness."""

collect_ignore_glob = ["all.py", "damage.py", "fuzz_*.py", "harness.py", "samples.py"]
