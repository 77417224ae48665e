"""The parallel manipulator SmartEE of De Luca, Mattone and Sciandrone."""
