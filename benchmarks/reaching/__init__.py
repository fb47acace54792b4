"""Random reaches in clutter: scenes, targets, closed loop, and independent checks."""
