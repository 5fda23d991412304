"""An example plug-in: a mesh format, a post, a strategy, a cutter, limits and a robot family of a workshop's own."""
