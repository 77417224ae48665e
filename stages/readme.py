"""Put the main tables into the README, between their markers."""

from start import run


def main() -> None:
    """Read reports/ and data/reference/, write README.md."""
    from flexik.reporting.overview import update

    update("README.md")


if __name__ == "__main__":
    run(main)
