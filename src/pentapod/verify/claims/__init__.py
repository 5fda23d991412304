"""Claims: each judges one thing of a replay; a file for each."""
