"""The program as the controller runs it, and bounds that hold at every time."""
