"""The single-stroke font that ships with the package, as data."""

__all__: list[str] = []
