"""Values and contracts that all simulated systems share: parameters, state space, ports, laws."""
