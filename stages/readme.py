"""Put the main tables into the README, between their markers, and renew docs/."""

from start import run


def main() -> None:
    """Read reports/ and data/reference/, write README.md; write docs/ from the models."""
    from flexik import docs
    from flexik.reporting import overview

    overview.update("README.md")
    docs.update()


if __name__ == "__main__":
    run(main)
