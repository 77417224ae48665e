"""Studies of the arm: fit and sensitivity of networks given gauges, payload error, divisions."""

import functools
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from flexik.cases.elastic_arm.parts import evaluate, gauges, study_splits
from flexik.cases.elastic_arm.parts.study_gauges import prepare_fit, prepare_sensitivity
from flexik.cases.elastic_arm.parts.trained import Trained, files_of
from flexik.cases.elastic_arm.section import Gauge, Section
from flexik.datasets.parts import Part, Work, rows
from flexik.datasets.tables import Field

PAYLOAD_ERROR_FIELDS = (
    Field("method", "1", "name of the method", "string"),
    Field("mean_error", "m", "over the targets, where the payload is told too large"),
)


def parts(section: Section) -> list[Part]:
    """One part a study."""
    conditions = next(iter(section.conditions))
    told = {
        label: evaluate.described(section, conditions, label)
        for label, method in section.methods.items()
        if method.needs and not isinstance(method, Gauge)
    }
    settings = {
        "methods": {label: of["settings"] for label, of in told.items()},
        "too_much": section.studies.payload_error,
    }
    files = {label: of["inputs"] for label, of in told.items()}
    gauge_part = functools.partial(_gauge_part, section)
    main = section.studies.splits.network
    return [
        gauge_part("fit", prepare_fit, section.gauge_networks),
        gauge_part("sensitivity", prepare_sensitivity, compared(section), with_restarts=main),
        Part("payload_error", prepare_payload_error, settings, {"files": files}),
        study_splits.part(section),
    ]


def compared(section: Section) -> list[str]:
    """Networks given gauges that a method takes, or the published one."""
    names = [method.network for method in section.methods.values() if isinstance(method, Gauge)]
    return [name for name in dict.fromkeys([*names, section.studies.splits.network]) if name]


def _gauge_part(
    section: Section,
    name: str,
    prepare: Callable[..., Work],
    networks: Iterable[str],
    **settings: str,
) -> Part:
    known = {network: section.networks[network] for network in networks}
    readings = section.data / "samples/readings"
    tables = {"": readings.with_suffix(".parquet")}
    tables |= {shown: readings.with_suffix(f".{shown}.parquet") for shown in gauges.SHOWN}
    files = {network: files_of(section, network) for network in known}
    given = {"machine": section.machine, "networks": known, **settings}
    return Part(name, prepare, given, {"tables": tables, "files": files})


def prepare_payload_error(
    *,
    methods: Mapping[str, Mapping[str, Any]],
    too_much: float,
    files: Mapping[str, Mapping[str, Any]],
) -> Work:
    """Mean errors of methods that are told `too_much` payload (kg)."""
    items = []
    for label, settings in methods.items():
        work = evaluate.prepare(**settings, **files[label])
        items += [(label, work.function, trained) for trained in work.items if trained.is_chosen]
    return Work(functools.partial(_told, too_much), items, rows(*PAYLOAD_ERROR_FIELDS))


def _told(too_much: float, item: tuple[str, Callable[..., Any], Trained]) -> dict[str, Any]:
    label, errors, trained = item
    error = errors(trained, told_too_much=too_much)["error"]
    return {"method": [label], "mean_error": [error.mean()]}
