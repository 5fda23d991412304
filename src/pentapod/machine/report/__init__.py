"""What a machine can do: its work volume sampled, the worst poses and their text; its modes at power-on."""
