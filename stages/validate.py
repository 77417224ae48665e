"""Check params.yaml and the machine files before anything is computed."""

from start import run


def main() -> None:
    """Load and check every case; the content of data/validated.txt never changes."""
    from flexik.cases import case as cases
    from flexik.files import write_text

    cases.load_parallel()
    for section in cases.load_all().values():
        cases.check(section)
    write_text("data/validated.txt", "params.yaml is valid\n")


if __name__ == "__main__":
    run(main)
