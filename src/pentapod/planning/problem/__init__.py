"""The planning problem: samples of the toolpath, constraints, tilt field, and models of them."""
