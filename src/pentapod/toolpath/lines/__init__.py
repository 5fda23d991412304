"""Lines on a surface: stepover, gap filling, projection."""
