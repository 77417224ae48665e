"""What the stages of the six-joint arm compute."""
