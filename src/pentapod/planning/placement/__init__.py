"""Where the part is clamped: sampling, search, and the solvers that improve a placement."""
