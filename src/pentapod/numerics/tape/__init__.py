"""casadi functions on many points: the instructions of their tape carried out by a kernel."""
