"""The program: its commands by rule, and how it ends.

Every file in commands/ is the command of its name, by a function of its name; it is imported when
the command runs. place is what runs without a command.
"""

import signal
import sys
from pkgutil import iter_modules

from cyclopts import App, CycloptsError

from .._errors import InputError
from ..formats.errors import UserError
from ..reporting.terminal import Terminal, say
from . import commands
from .commands.place import place
from .compilation_cache import keep_compiled
from .options.arguments import option_of


def _version() -> str:
    from importlib.metadata import version

    return version("place-rings")


app = App(
    name="place-rings",
    help="""Find where rings of Time-of-Flight sensors belong on a robot arm, and prove how much \
they see.

Examples: ``place-rings --target V_S --radius 0.5`` near the robot,
``place-rings --target V_S:0.5=0.6 --target V_S:1.5=0.4 --rings-per-link 3`` near and far,
``place-rings verify n2_16_25 --target V_O`` for a setup that is already there.""",
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
    """Run the command line; bad input is one line on stderr and exit code 2."""
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    keep_compiled()
    words = sys.argv[1:]
    if not set(app.help_flags).isdisjoint(words):
        app.resolved_commands()  # the list of commands shows the first line of each one's docstring
    try:
        app(words, exit_on_error=False, print_error=False)
    except (UserError, CycloptsError, ValueError) as error:
        text = error.written(option_of) if isinstance(error, InputError) else str(error)
        say(f"place-rings: {' '.join(text.split())}", error=True)
        sys.exit(2)
