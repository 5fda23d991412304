"""Commands about programs that run, or have run, on a machine."""
