"""Draw a set of poses of the SmartEE and compute their joint angles.

Usage: smartee_generate.py POSES, a name under smartee.poses.
Reads params.yaml: smartee.geometry, smartee.workspace, the set under smartee.poses.
Writes data/smartee/poses/POSES.parquet.
"""

from pathlib import Path

from flexik import stage
from flexik.datasets.smartee.poses import generate
from flexik.errors import ParameterError
from flexik.parameters import load_parameters

DATA = Path("data/smartee/poses")


def main() -> None:
    """Run the stage."""
    smartee, name = load_parameters().smartee, stage.argument("POSES")
    if name not in smartee.poses:
        known = ", ".join(smartee.poses)
        raise ParameterError(f"smartee.poses: there is no set {name!r} ({known})")
    n_rows = generate(DATA / f"{name}.parquet", smartee, name)
    print(f"{name}: {n_rows} rows of {smartee.poses[name].n_poses} poses")


if __name__ == "__main__":
    stage.run(main)
