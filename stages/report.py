"""Tables, figures, metrics and page of a case, beside the published values."""

from start import run_stage

if __name__ == "__main__":
    run_stage("report", __doc__)
