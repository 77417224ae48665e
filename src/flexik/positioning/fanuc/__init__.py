"""Methods that give the joints of the six-joint arm for a pose, and how their networks learn."""
