"""Fit the constants of a machine that are free to what is published of it."""

from start import run_stage

if __name__ == "__main__":
    run_stage("calibrate", __doc__)
