"""Command a machine by every method under every set of conditions, and record the errors."""

from start import run_stage

if __name__ == "__main__":
    run_stage("evaluate", __doc__)
