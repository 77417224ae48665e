"""The command `flexik`, or `python -m flexik`, in the folder of the project."""

import argparse
import sys
from collections.abc import Sequence

from flexik import kernels

kernels.fix()  # before NumPy is imported

from flexik.stage import run  # noqa: E402


def main(arguments: Sequence[str] | None = None) -> None:
    """Do what the command line says; a user's mistake is one line and exit status 1."""
    parser = argparse.ArgumentParser(
        prog="flexik", description="Planar flexible machines: begin, check and run one."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    new = commands.add_parser("new", help="begin a machine: a file and a section of params.yaml")
    new.add_argument("name", help="small letters, digits and _")
    new.add_argument(
        "--like",
        default="excavator",
        help="begin from it: excavator, a boom with cylinders, or concrete_pump, a serial arm",
    )
    check = commands.add_parser("check", help="what is wrong with a machine; totals and a picture")
    check.add_argument("name", help="a case of params.yaml")
    whole = commands.add_parser("run", help="run a case through DVC, to its report")
    whole.add_argument("name", help="a case of params.yaml")
    given = parser.parse_args(arguments)

    def chosen() -> None:
        from flexik import commands as do

        if given.command == "run":
            sys.exit(do.run(given.name))
        lines = do.new(given.name, given.like) if given.command == "new" else do.check(given.name)
        print("\n".join(lines))

    run(chosen)


if __name__ == "__main__":
    main()
