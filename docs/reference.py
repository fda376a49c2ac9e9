"""Write the generated sections of the reference pages: commands, files and Python.

A section stands between a mark, such as ``<!-- keys: scene -->``, and ``<!-- end -->``. The marks
of the Python page list the public names in their order. A test holds the pages equal to the code.

Run: python docs/reference.py
"""

import re
import subprocess
import sys
from pathlib import Path

import place_rings as pr

sys.path.insert(0, str(Path(__file__).parent))  # the files beside this one

import api_pages
import keys

FOLDER = Path(__file__).parent / "reference"
_COMMANDS = """
import sys
from cyclopts.docs.markdown import generate_markdown_docs
from place_rings.cli.app import app
sys.stdout.reconfigure(encoding="utf-8")
sys.argv = ["place-rings"]  # the usage line begins with this name
app.resolved_commands()  # loads the docstrings that the list of commands shows
print(generate_markdown_docs(app, heading_level=2, no_root_title=True, generate_toc=False))
"""
_MARK = r"^<!-- (commands|keys|api)(?:: ([\w ]+))? -->$"
# examples name files that a user has; tests of the help parse each of them
_EXAMPLE = "<!-- no-run: examples of the help; a test parses them -->"
_SECTION = re.compile(
    _MARK + r"(?:(?:(?!^<!-- (?:commands|keys|api)\b).)*?^<!-- end -->$)?",
    re.MULTILINE | re.DOTALL,
)


def commands() -> str:
    """Return all commands with their options as Markdown.

    They come from a process of their own, because their order depends on what ran before.
    """
    line = (sys.executable, "-c", _COMMANDS)
    text = subprocess.run(line, check=True, capture_output=True, encoding="utf-8").stdout
    text = re.sub(r"[ \t]+$", "", text, flags=re.MULTILINE).strip()
    text = re.sub(r"\n {8}(?=\S)", " ", text)  # one line for each option
    text = re.sub(r"(?<!`)``(?!`)", "`", text)
    return text.replace("```bash\n", f"{_EXAMPLE}\n```bash\n")


def page(text: str) -> str:
    """Return a page with its generated sections."""
    tables = keys.KeyTables()

    def section(found: re.Match[str]) -> str:
        kind, names = found[1], (found[2] or "").strip()
        if kind == "commands":
            made = commands()
        elif kind == "keys":
            made = tables.of(names)
        else:
            made = api_pages.sections(names)
        mark = f"<!-- {kind}: {names} -->" if names else f"<!-- {kind} -->"
        return f"{mark}\n\n{made}\n\n<!-- end -->"

    return _SECTION.sub(section, text)


def missing(text: str) -> set[str]:
    """Return the public names without a section on a page."""
    listed = {
        name for mark in re.finditer(_MARK, text, re.MULTILINE) for name in (mark[2] or "").split()
    }
    return set(pr.__all__) - listed


def main() -> None:
    """Write the pages."""
    for file in sorted(FOLDER.glob("*.md")):
        file.write_text(page(file.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
