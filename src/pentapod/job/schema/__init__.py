"""Schema of the job file: every key with its unit, default and range."""
