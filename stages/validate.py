"""Check params.yaml and the machine files before anything is computed.

Writes what it found valid into data/validated, defaults put in: trainers.json and CASE.json. Stages
that read all of it depend on these files: in params they would fill dvc.lock.
"""

from start import run


def main() -> None:
    """Load and check every case; the content of data/validated.txt never changes."""
    from flexik.cases import case as cases
    from flexik.files import write_json, write_text

    cases.load_parallel()
    sections = cases.load_all()
    for section in sections.values():
        cases.check(section)
    for name, section in sections.items():
        given = section.model_dump(mode="json")
        write_json("data/validated/trainers.json", given.pop("trainers"))
        write_json(f"data/validated/{name}.json", given)
    write_text("data/validated.txt", "params.yaml is valid\n")


if __name__ == "__main__":
    run(main)
