"""What can be said about a machine: checked where it is advertised to work, and told."""
