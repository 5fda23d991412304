"""Ways from the machine's park pose to a program and back: made, judged, and joined for a restart in the middle."""
