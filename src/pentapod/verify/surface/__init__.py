"""What the replayed cutter leaves on the surface."""
