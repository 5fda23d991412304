"""Commands that evaluate many designs."""
