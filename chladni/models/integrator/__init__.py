"""The compiled integrator: any model with any set of laws."""
