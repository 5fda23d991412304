"""All poses of leg readings, by exhaustive search with proof."""
