"""Material that the replayed cutter leaves on the surface."""
