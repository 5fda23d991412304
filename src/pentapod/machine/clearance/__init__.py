"""What must not touch: legs, spindle, tool, and what stands around them."""
