"""What every stage shares: one line for a user's mistake, and a non-zero exit status."""

import sys
from collections.abc import Callable

from flexik.errors import FlexikError


def run(main: Callable[[], None]) -> None:
    """Run `main`; a FlexikError ends the process with its message alone."""
    try:
        main()
    except FlexikError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted; finished parts are kept", file=sys.stderr)
        sys.exit(130)
