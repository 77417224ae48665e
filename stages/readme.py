"""Put the main table into the README, between its markers.

Reads reports/crane/positioning_errors.md; writes README.md.
"""

from pathlib import Path

from flexik import stage
from flexik.errors import DataError
from flexik.files import write_text
from flexik.reporting.blocks import replace_block

README = Path("README.md")
TABLE = Path("reports/crane/positioning_errors.md")


def main() -> None:
    """Run the stage."""
    try:
        text, table = README.read_text(encoding="utf-8"), TABLE.read_text(encoding="utf-8")
    except OSError as error:
        raise DataError(f"{error.filename}: cannot be read ({error.strerror})") from None
    write_text(README, replace_block(text, "positioning_errors", table))


if __name__ == "__main__":
    stage.run(main)
