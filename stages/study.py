"""Vary one thing: size, trainer, tolerance, mesh, a machine as it was built."""

from start import run_stage

if __name__ == "__main__":
    run_stage("study", __doc__)
