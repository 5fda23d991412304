"""The nominal tool axis along a toolpath."""
