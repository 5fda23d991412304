"""From lines to a toolpath: waypoints, order, links, pieces."""
