"""Words of G-code: how controllers write them, and what they mean."""
