"""Makes the paths of this folder importable from those below it."""
