"""The pipeline of a job: its stages, attempts at it, other ways after one that failed, set-ups, advice."""
