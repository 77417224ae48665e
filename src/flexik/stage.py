"""What every stage shares: one line for a user's mistake, and a non-zero exit status."""

import sys
from collections.abc import Callable

from flexik.errors import FlexikError


def argument(name: str) -> str:
    """The one argument of the script; raises FlexikError naming it as `name` if there is none."""
    if len(sys.argv) != 2:
        raise FlexikError(f"usage: {sys.argv[0]} {name}")
    return sys.argv[1]


def run(main: Callable[[], None]) -> None:
    """Run `main`; a FlexikError ends the process with its message alone."""
    try:
        main()
    except FlexikError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
