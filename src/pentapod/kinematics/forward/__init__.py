"""Forward kinematics: closed forms of the families, and their line equations."""
