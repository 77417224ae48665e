"""What is judged on the crane alone: calibration and the measured campaign."""
