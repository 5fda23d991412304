"""An example plug-in: a post, a strategy, a cutter, limits and a robot family of a workshop's own."""
