"""The gap between a simulation and a log: where it lies, what causes it, how far it closes."""
