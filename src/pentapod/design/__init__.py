"""Machine design: searches for geometries, proofs of what they keep, and their machine files."""
