"""The elastic arm of params.yaml, for tests."""

from pathlib import Path

from flexik.multibody.elastic_arm.assembly import flexible_arm
from flexik.parameters import load_parameters

ROOT = Path(__file__).resolve().parents[1]
ARM = load_parameters(ROOT / "params.yaml").elastic_arm
MODEL = flexible_arm(ARM)
GEOMETRY = MODEL.geometry
