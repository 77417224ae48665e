"""Train every network of a case from several starts; the selection set chooses among them."""

from start import run_stage

if __name__ == "__main__":
    run_stage("train", __doc__)
