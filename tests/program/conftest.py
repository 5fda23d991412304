"""Makes the motions of this folder importable from those below it."""
