"""From placed poses to leg lengths: C3 curves between exact stops."""
