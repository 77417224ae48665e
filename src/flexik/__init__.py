"""flexik: actuator strokes that put the tip of a flexible manipulator on its target."""
