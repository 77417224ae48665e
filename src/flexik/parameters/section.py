"""What the section of every case has."""

from pathlib import Path
from typing import ClassVar

from flexik.parameters.model import Model, Name
from flexik.parameters.trainers import Trainer

DATA, REPORTS, MACHINES = Path("data"), Path("reports"), Path("data/machines")


class CaseSection(Model):
    """A case by the name of its section; a case adds its machine and its own keys.

    code : folder of flexik/cases whose code it runs
    calibration : settings of the fit where constants of the machine are free
    """

    put_in: ClassVar[frozenset[str]] = frozenset({"name", "code", "machine", "trainers"})

    name: Name
    code: Name
    trainers: dict[Name, Trainer]
    calibration: None = None

    @property
    def data(self) -> Path:
        """Folder of what the stages make."""
        return DATA / self.name

    @property
    def report(self) -> Path:
        """Folder of the report."""
        return REPORTS / self.name

    @property
    def files(self) -> list[Path]:
        """Files that the section names, which count by their content."""
        return []

    @property
    def machine_file(self) -> Path:
        """The file that describes the machine."""
        return MACHINES / f"{self.name}.yaml"
