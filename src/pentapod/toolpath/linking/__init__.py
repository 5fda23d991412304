"""From contact lines to a toolpath: waypoints, order, links, partition."""
