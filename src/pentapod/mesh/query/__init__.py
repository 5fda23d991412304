"""Questions to a mesh: what is near, how deep a body reaches, geodesics, slices."""
