"""The pages of docs/: what machine files and params.yaml may hold, from the models of them."""

import inspect
from pathlib import Path
from typing import Any

from flexik.cases.general.section import Section
from flexik.files import write_text
from flexik.machines import planar
from flexik.parameters import describe
from flexik.parameters.trainers import Trainer
from flexik.planar.own_samples import UNITS
from flexik.reporting import page

FOLDER = Path("docs")
TEMPLATE = Path(page.__file__).with_name("keys.md.j2")
# Models by file
ROOTS: dict[str, tuple[Any, ...]] = {
    "machine_file.md": (planar.PlanarMachine,),
    "params.md": (Section, Trainer),
}


def pages() -> dict[str, str]:
    """Text of every page by the name of its file."""
    words = inspect.cleandoc(planar.__doc__ or "").partition("\n\n")[2]
    shared = {"describe": describe, "units": list(UNITS), "machine_words": words}
    return {
        name: page.render(
            TEMPLATE,
            {},
            [],
            {"models": describe.models_in(*roots), "of_machine": "machine" in name, **shared},
        ).text
        for name, roots in ROOTS.items()
    }


def update() -> None:
    """Write all pages."""
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        write_text(FOLDER / name, text)
