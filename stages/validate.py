"""Check params.yaml and the machine files before anything is computed.

Writes what it found valid, defaults put in, into data/validated: trainers.json, and for each case a
file a key of its section and files.json, checksums of the files that it names. Stages depend on
them, so that a changed default counts as a changed value does.
"""

from start import run


def main() -> None:
    """Load and check every case; the content of data/validated.txt never changes."""
    from flexik.cases import case as cases
    from flexik.files import file_checksum, write_json, write_text

    cases.load_parallel()
    sections = cases.load_all()
    for section in sections.values():
        cases.check(section)
    for name, section in sections.items():
        given = section.model_dump(mode="json")
        write_json("data/validated/trainers.json", given.pop("trainers"))
        given["files"] = {str(file): file_checksum(file) for file in section.files}
        for key, value in given.items():
            write_json(f"data/validated/{name}/{key}.json", value)
    write_text("data/validated.txt", "params.yaml is valid\n")


if __name__ == "__main__":
    run(main)
