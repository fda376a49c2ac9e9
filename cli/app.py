"""The command-line program: its commands and its exit codes.

Each file in commands/ defines the command of the same name in a function of the same name; the file
is imported when the command runs. ``place`` runs without a command.
"""

import signal
import sys
from pkgutil import iter_modules

from cyclopts import App, CycloptsError, Parameter
from place_rings._errors import InputError

from ..coverage.definitions.errors import UserError
from ..reporting.terminal import Terminal, say
from . import commands
from .commands.place import place
from .compilation_cache import keep_compiled
from .options.common import ARGUMENTS, COMMANDS, OPTIONS, option_of

_HELP = """Place rings of Time-of-Flight sensors on a robot arm, and prove how much they see.

Without a command, place-rings searches a placement, counts its coverage, and compares it with the
layouts of the paper (Kumar and Sahin, 2019). It writes a proposal: a file that the other
commands read.

These terms are used throughout:

- **Coverage**, or ζ (zeta): the share of a volume that at least one sensor sees, in percent.
- **Target**: the volume to cover. V_N(0.3) is everything within 0.3 m of the robot's bodies, the
  first choice for people near the arm. V_S(0.5) is the paper's shell: discs of 0.5 m across the
  arm's centre line, cut flat at the tool. V_O is the sphere of the robot's reach, V_T a sphere of
  1.5 m around the tool, V_OT both. V_P is the protective volume of ISO 10218-2:2025 (form of
  ISO/TS 15066). The robot itself is never part of a target.
- **Ring**: sensors that are evenly spaced around a link. Tilt is the angle of their axes out of the
  plane of the ring.
- **Setup**: all sensors on one robot, as a proposal, a list of sensors, or a layout of the paper.
- **n2_16_25**: the layout of the paper with 2 rings on each link, 16 sensors a ring, tilted by 25°,
  and one ring on the tool.
- **Scene**: robot, poses, sensor, targets, obstacles and rules. The reference scene is a UR10 in
  one pose with conical sensors of 25° and 1.5 m.
- **Occlusion**: what the robot's body does to the sensors. The option ``--occlusion`` lists the
  models. With ``shadow``, the default, points behind the robot are not covered. Rings are placed
  only where they can be mounted: around the links, clear of everything. ``--paper`` counts as the
  paper does: sensors see through the robot, and rings need no room on it.

For example:

```bash
# within 0.3 m of the robot, with rings that can be mounted
place-rings --target V_N --radius 0.3
# the paper's shell, and the same in the paper's world
place-rings --target V_S --radius 0.5
place-rings --target V_S --radius 0.5 --paper
# with 48 sensors on few rings, or with the fewest sensors that cover 95 %
place-rings --target V_S --radius 0.5 --sensors 48
place-rings --target V_S --radius 0.5 --reach 95
# 48 sensors on five rings, or on any number of rings for the last point of coverage
place-rings --target V_S --radius 0.5 --sensors 48 --rings 5
place-rings --target V_S --radius 0.5 --sensors 48 --any-rings
# near and far: with weights, or with at least 30 % far
place-rings --target V_S:0.5=0.6 --target V_S:1.5=0.4
place-rings --target V_S:0.5 --at-least V_S:1.5=30
# in your own cell
place-rings --scene cell.toml --target V_N:0.3 --out mine
```

``place-rings COMMAND --help`` explains a command.
"""


def _default_text(value: object) -> str | None:
    """Return the default of an option for its help; flags, repeatable options and empty texts show
    none."""
    return None if value is None or value is False or value == () else str(value) or None


def _version() -> str:
    from importlib.metadata import version

    return version("place-rings")


app = App(
    name="place-rings",
    usage="Usage: place-rings [OPTIONS], or place-rings COMMAND [OPTIONS]",
    help=_HELP,
    group_arguments=ARGUMENTS,
    group_commands=COMMANDS,
    group_parameters=OPTIONS,
    default_parameter=Parameter(show_default=_default_text),
    version=_version,
    suppress_keyboard_interrupt=False,
    console=Terminal(),
    error_console=Terminal(stderr=True),
)
app.default(place)
for _file in iter_modules(commands.__path__):
    if _file.name != place.__name__:
        app.command(f"{commands.__name__}.{_file.name}:{_file.name}", name=_file.name)


def main() -> None:
    """Run the command line; report bad input in one line on stderr with exit code 2."""
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    keep_compiled()
    words = sys.argv[1:]
    if not set(app.help_flags).isdisjoint(words):
        app.resolved_commands()  # loads the docstrings that the list of commands shows
    try:
        app(words, exit_on_error=False, print_error=False)
    except (UserError, CycloptsError, ValueError) as error:
        say(f"place-rings: {' '.join(_message(error).split())}", error=True)
        sys.exit(2)


def _message(error: Exception) -> str:
    """Return the text of an error, with options instead of arguments of the Python API."""
    match error:
        case InputError():
            return error.written(option_of)
        case CycloptsError():
            from .usage_errors import usage_line

            return usage_line(error, sorted(name for name in app if not name.startswith("-")))
        case _:
            return str(error)
