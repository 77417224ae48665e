"""Sample a machine into tables with units, in parallel, and draw targets that it reaches."""

from start import run_stage

if __name__ == "__main__":
    run_stage("generate", __doc__)
