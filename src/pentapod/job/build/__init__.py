"""From a job to the values that its stages start from, in SI units."""
