"""params.yaml as a validated model: a wrong value is one error that names its key.

Every key is required, none has a default: what a stage computes follows from params.yaml alone,
where DVC watches it. The names `size` and `nfiles` are never used: DVC's run cache ignores them.
"""

from flexik.parameters.crane import Crane
from flexik.parameters.data import Workspace
from flexik.parameters.elastic_arm import (
    ArmMethod,
    ArmNetwork,
    CombinedMethod,
    DegreeAxis,
    ElasticArm,
    GaugeMethod,
    Readings,
    SelectedArmNetwork,
)
from flexik.parameters.fanuc import Fanuc, PathNetwork
from flexik.parameters.fanuc import Path as FanucPath
from flexik.parameters.measured import Measured
from flexik.parameters.methods import CombinedModel, InvertedModel, MethodModel
from flexik.parameters.model import Model as Section
from flexik.parameters.networks import (
    AnyNetwork,
    ModularNetwork,
    NetworkModel,
    SelectedModularNetwork,
)
from flexik.parameters.reading import (
    PARAMETERS_FILE,
    Parameters,
    load_parameters,
    overlay,
    parameters_checksum,
    read_yaml,
    validate,
)
from flexik.parameters.smartee import SmartEE
from flexik.parameters.smartee import Workspace as SmartEEWorkspace
from flexik.parameters.structure import Structure
from flexik.parameters.trainers import BackPropagation

__all__ = [
    "PARAMETERS_FILE",
    "AnyNetwork",
    "ArmMethod",
    "ArmNetwork",
    "BackPropagation",
    "CombinedMethod",
    "CombinedModel",
    "Crane",
    "DegreeAxis",
    "ElasticArm",
    "Fanuc",
    "FanucPath",
    "GaugeMethod",
    "InvertedModel",
    "Measured",
    "MethodModel",
    "ModularNetwork",
    "NetworkModel",
    "Parameters",
    "PathNetwork",
    "Readings",
    "Section",
    "SelectedArmNetwork",
    "SelectedModularNetwork",
    "SmartEE",
    "SmartEEWorkspace",
    "Structure",
    "Workspace",
    "load_parameters",
    "overlay",
    "parameters_checksum",
    "read_yaml",
    "validate",
]
