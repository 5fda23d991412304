"""What a verdict is about, and what it says."""
