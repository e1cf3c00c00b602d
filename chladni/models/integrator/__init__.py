"""The compiled integrator: any model with any set of laws."""

# The place of the cache is chosen before any module of this package imports numba, which reads it once.
from chladni.signals import cache_folder as cache_folder
