"""What every stage does: read the parameters, make its parts; one line for a user's mistake."""

import argparse
import sys
from collections.abc import Callable, Sequence

from flexik import kernels
from flexik.errors import FlexikError


def run(main: Callable[[], None]) -> None:
    """Run `main`; a FlexikError ends the process with its message alone."""
    try:
        main()
    except FlexikError as error:
        lines = (f"error: {line}" for line in str(error).splitlines())
        print("\n".join(lines), file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)


def run_stage(name: str, description: str, arguments: Sequence[str] | None = None) -> None:
    """Run stage `name` of the case that the command line names."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("case", help="a case of params.yaml")
    case = parser.parse_args(arguments).case
    run(lambda: _stage(name, case))


def _stage(name: str, case: str) -> None:
    # after kernels.fix(), which must come before NumPy is imported
    from flexik.cases import case as cases
    from flexik.datasets.parallel import from_environment
    from flexik.datasets.parts import make

    if other := kernels.differences():
        print(f"note: {other}", file=sys.stderr)
    section, parallel = cases.load(case), from_environment(cases.load_parallel())
    if name == "report":
        found = cases.module(section.code, "report")
        assert found is not None  # a test sees to it
        found.report(section)
    else:
        make(section.data / cases.STAGES[name], cases.parts(section, name), parallel)
