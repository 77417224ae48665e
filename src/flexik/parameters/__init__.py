"""What sections of params.yaml and machine files are made of, and how they are read."""

# interim: names that modules still to be rebuilt ask for
_OLD = {
    "Crane": "crane", "Workspace": "data", "ElasticArm": "elastic_arm", "ArmMethod": "elastic_arm",
    "ArmNetwork": "elastic_arm", "CombinedMethod": "elastic_arm", "DegreeAxis": "elastic_arm",
    "GaugeMethod": "elastic_arm", "Readings": "elastic_arm", "SelectedArmNetwork": "elastic_arm",
    "Fanuc": "fanuc", "PathNetwork": "fanuc", "Measured": "measured", "CombinedModel": "methods",
    "InvertedModel": "methods", "MethodModel": "methods", "AnyNetwork": "networks",
    "ModularNetwork": "networks", "NetworkModel": "networks", "SelectedModularNetwork": "networks",
    "SmartEE": "smartee", "Structure": "structure", "BackPropagation": "trainers",
}  # fmt: skip


def __getattr__(name: str) -> object:
    import importlib

    if name in _OLD:
        return getattr(importlib.import_module(f"flexik.parameters.{_OLD[name]}"), name)
    if name == "Section":
        return importlib.import_module("flexik.parameters.model").Model
    reading = importlib.import_module("flexik.parameters.reading")
    if hasattr(reading, name):
        return getattr(reading, name)
    raise AttributeError(name)
