"""What the set-up sheet draws and lists beside the views: dimension lines, touch-off points."""
