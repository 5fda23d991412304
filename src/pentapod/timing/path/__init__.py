"""The path as the time law sees it: pieces, their derivatives, and the setpoints on them."""
