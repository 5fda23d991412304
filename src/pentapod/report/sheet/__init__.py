"""The set-up sheet: drawings with dimensions, touch-off points, numbers, and the page that is printed."""
