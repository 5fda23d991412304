"""The machine as rigid bodies with joints, in the formats of simulators: MJCF (MuJoCo) and SDF (Gazebo)."""
