"""Studies of a planar machine, beside its measured twin, in params.yaml."""

from typing import Annotated, Any

from pydantic import Field

from flexik.errors import ParameterError
from flexik.parameters.conditions import RandomTargets
from flexik.parameters.model import Count, Model, Name, NotNegative, Seed
from flexik.planar.section import PlanarSection, Samples

# What networks of learning curves may learn
CURVES = ("deflection", "remainder")


class CorrectionStudy(Model):
    """Numbers of corrections of `methods`, on the first targets of random `conditions`."""

    methods: Annotated[list[Name], Field(min_length=1)]
    n_corrections: Annotated[list[Count], Field(min_length=1)] = [1, 2, 3, 5, 20]  # noqa: RUF012
    conditions: Name = "workspace"
    n_targets: Count = 500


class LearningCurves(Model):
    """Networks from fewer and from more samples.

    networks : names of networks of deflection or remainder whose size is given.
    n_samples : random ones, between the least and the largest payload of the grid.
    n_levels : payloads of the grid that are kept, as evenly spaced as it has them.
    n_restarts : of each; at most those of the network itself.
    n_judged : random samples that judge.
    outside : payloads with which they judge again, kg.
    seed : of the samples.
    """

    networks: Annotated[tuple[Name, ...], Field(min_length=1)]
    n_samples: tuple[Count, ...] = (250, 1000, 4000)
    n_levels: tuple[Annotated[int, Field(ge=2)], ...] = (2, 3, 5, 10)
    n_restarts: Count = 2
    n_judged: Count = 1000
    outside: tuple[NotNegative, ...] = ()
    seed: Seed = 1


class PhysicsStudy(Model):
    """Variants of the machine: what is left open about it.

    variants : by name, other values of dotted keys of the machine file.
    methods : those that command each variant; with beam theory of the variant, the machine.
    conditions : random targets, of which the first `n_targets`.
    n_restarts : of networks that learn what the theory of a variant leaves; at most their own.
    """

    variants: Annotated[dict[Name, dict[str, Any]], Field(min_length=1)]
    methods: Annotated[list[Name], Field(min_length=1)]
    conditions: Name = "workspace"
    n_targets: Count = 500
    n_restarts: Count = 2


def check_curves(section: PlanarSection, study: LearningCurves | None) -> None:
    """Raise ValueError unless the networks of `study` are there and can be judged by the tip."""
    if study and not isinstance(section.samples, Samples):
        raise ValueError("studies.learning_curves: expected none, samples of a file have no model")
    for number, name in enumerate(study.networks if study else ()):
        network = section.networks.get(name)
        if network is None or network.is_selected or network.learns not in CURVES:
            raise ValueError(
                f"studies.learning_curves.networks.{number}: expected a network of given size that "
                f"learns {' or '.join(CURVES)}, got {name!r}"
            )


def check_physics(section: PlanarSection, study: PhysicsStudy | None) -> None:
    """Raise ValueError unless methods, conditions and keys of the variants of `study` are there."""
    if study is None:
        return
    if not isinstance(section.samples, Samples):
        raise ValueError("studies.physics: expected none, samples of a file have no model")
    if not isinstance(section.conditions.get(study.conditions), RandomTargets):
        raise ValueError(f"studies.physics.conditions: no random targets {study.conditions!r}")
    for number, name in enumerate(study.methods):
        if name not in section.methods:
            raise ValueError(f"studies.physics.methods.{number}: there is no method {name!r}")
    for name, keys in study.variants.items():
        try:
            section.machine.with_constants(keys)
        except ParameterError as error:
            said = str(error).removeprefix("constants: ")
            raise ValueError(f"studies.physics.variants.{name}: {said}") from None
        if taken := keys.keys() & set(section.machine.free):
            raise ValueError(f"studies.physics.variants.{name}.{min(taken)}: it is fitted")
