"""The page on a run: what its script draws, and what it says without a script."""
