"""Command line: one file for each verb; heavy modules are imported where they are used. No Python interface."""

__all__: list[str] = []
