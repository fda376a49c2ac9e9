"""Where the command starts: the rest is imported under guard, as that takes a second and Ctrl-C may come before."""

import os
import sys


def main() -> None:
    """Run the command line."""
    try:
        from .main import main as run

        run()
    except KeyboardInterrupt:
        print("place-rings: interrupted before there was anything to keep", file=sys.stderr, flush=True)
        os._exit(130)


if __name__ == "__main__":
    main()
