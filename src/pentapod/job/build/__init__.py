"""The inputs of the stages, SI, made from a job."""
