"""The command line: one file for each verb. Modules here import nothing heavy at their top.

It has no Python interface; `pentapod.cli.main` holds the entry point.
"""

__all__: list[str] = []
