"""What happens to a running trajectory: feed override, transitions."""
