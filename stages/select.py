"""Train networks of many sizes from several starts, and choose their size by selection error."""

from start import run_stage

if __name__ == "__main__":
    run_stage("select", __doc__)
