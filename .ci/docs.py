"""Check the documentation: build it, then run every bash and Python block of the README and the
pages.

Pages run side by side, one on each core; the blocks of a page run in order, in an empty folder of
its own. A TOML block whose first line is a
comment with a file name (``# cell.toml``) is written to that file. A ``text`` block right after a
block quotes its output: every line must appear, in order. There … stands for anything, and numbers
may differ by one percent, as a search may end slightly elsewhere on another processor. What JAX
compiles for one block serves the others. To leave out a block that needs a rig or many minutes, put
a comment in the line above it:
<!-- no-run: REASON -->

Usage: python .ci/docs.py [PAGE ...]; without pages: the README, all pages of docs/, and the build.
"""

import os
import re
import resource
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
_FENCE = re.compile(
    r"(?:^<!-- no-run: (\S[^\n]*?) -->\n)?^```(\w+)\n(.*?)^```$(?:\n+^```text\n(.*?)^```$)?",
    re.MULTILINE | re.DOTALL,
)
_FILE = re.compile(r"# (\w+\.toml)\n")
_ANY_FENCE = re.compile(
    r"^[ >]*(?:```|~~~)+ *\{?(?:bash|sh|shell|python\d?|py|code-block)\b.*$", re.MULTILINE
)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_LOADED = re.compile(r"<(?:script|img|link|iframe)\b[^>]*\b(?:src|href)=\"(?:https?:)?//[^\"]*\"")
_LIMIT = 600  # s, time limit of a block
_LONGEST = 10  # blocks that are listed at the end
_ENVIRONMENT = os.environ | {
    "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"])),
    "PYTHONSAFEPATH": "1",
    "MPLBACKEND": "agg",
    "COLUMNS": "125",
    "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.1",
    # as in the tests: compiles in a third of the time
    "XLA_FLAGS": os.environ.get(
        "XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false --xla_backend_optimization_level=1"
    ),
}


@dataclass(frozen=True)
class Block:
    """A block of a page."""

    language: str
    """bash, python or toml."""
    text: str
    """Content of the block."""
    line: int
    """Line on which the block begins."""
    reason: str | None
    """Reason why it is not run, or None."""
    quoted: str | None
    """Quoted output, or None."""


def pages(root: Path = ROOT) -> list[Path]:
    """Return the README and all pages of the docs."""
    return [
        root / "README.md",
        *sorted(p for p in (root / "docs").rglob("*.md") if "_build" not in p.parts),
    ]


def blocks(text: str) -> list[Block]:
    """Return the bash and Python blocks of a page, and the TOML blocks that name a file.

    Raises:
        ValueError: for a block that would be overlooked.
    """
    every = [
        Block(m[2], m[3], text.count("\n", 0, m.start(2)) + 1, m[1], m[4])
        for m in _FENCE.finditer(text)
    ]
    run = [
        block
        for block in every
        if block.language in ("bash", "python")
        or (block.language == "toml" and _FILE.match(block.text))
    ]
    lines = {block.line for block in run}
    for fence in _ANY_FENCE.finditer(text):
        if (line := text.count("\n", 0, fence.start()) + 1) not in lines:
            raise ValueError(f"line {line}: {fence[0]!r} is not run; write ```bash or ```python")
    reasons = sum(block.reason is not None for block in run)
    if reasons != text.count("<!-- no-run"):
        raise ValueError("a no-run comment must stand right above a block")
    return run


def missing(quoted: str, output: str) -> str | None:
    """Return the first line of ``quoted`` that is not in ``output`` after the lines before it."""
    rest = iter(output.splitlines())
    for line in filter(str.strip, quoted.splitlines()):
        if line.strip() != "…" and not any(_line(line.split(), other.split()) for other in rest):
            return line
    return None


def _line(quoted: list[str], said: list[str]) -> bool:
    """Return whether the words of two lines match; a word … matches any number of words."""
    if not quoted:
        return not said
    if quoted[0] == "…":
        return any(_line(quoted[1:], said[i:]) for i in range(len(said) + 1))
    return bool(said) and _word(quoted[0], said[0]) and _line(quoted[1:], said[1:])


def _word(quoted: str, said: str) -> bool:
    """Return whether two words match; numbers may differ by one percent."""
    if _NUMBER.split(quoted) != _NUMBER.split(said):
        return False
    pairs = zip(_NUMBER.findall(quoted), _NUMBER.findall(said), strict=True)
    return all(abs(float(a) - float(b)) <= max(0.01 * abs(float(a)), 0.011) for a, b in pairs)


def processor_seconds() -> float:
    """Return the processor time of all ended children, which does not depend on other work."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(page: Path, compiled: str) -> tuple[dict[str, float], int]:
    """Run a page's blocks with a folder for what JAX compiles; return the processor time of those
    that ran, and how many were left out.
    """
    name, all_blocks = page.relative_to(ROOT), blocks(page.read_text())
    seconds: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        for block in all_blocks:
            if block.reason:
                continue
            if block.language == "toml":
                (Path(folder) / _FILE.match(block.text)[1]).write_text(block.text)
                continue
            where = f"{name}:{block.line}"
            seconds[where] = _run_block(block, where, folder, compiled)
    return seconds, sum(block.reason is not None for block in all_blocks)


def _run_block(block: Block, where: str, folder: str, compiled: str) -> float:
    """Run one block in a folder; return its processor time.

    Raises:
        SystemExit: if it fails or does not print the quoted output.
    """
    began = processor_seconds()
    python, bash = [sys.executable, "-c"], ["bash", "-euo", "pipefail", "-c"]
    done = subprocess.run(
        [*(python if block.language == "python" else bash), block.text],
        cwd=folder,
        env=_ENVIRONMENT | {"JAX_COMPILATION_CACHE_DIR": compiled},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=_LIMIT,
    )
    if done.returncode:
        raise SystemExit(f"{where}: exit code {done.returncode}\n{done.stdout}\n{done.stderr}")
    if block.quoted and (line := missing(block.quoted, done.stdout)) is not None:
        raise SystemExit(f"{where}: quoted output is missing: {line}\n{done.stdout}")
    spent = processor_seconds() - began
    print(f"{where}: {spent:.0f} processor seconds", flush=True)
    return spent


def build() -> None:
    """Build the pages with warnings as errors, and check that they load nothing from the
    network.
    """
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "sphinx",
            "-W",
            "--keep-going",
            "-q",
            "-b",
            "html",
            ROOT / "docs",
            folder,
        ]
        subprocess.run(command, env=_ENVIRONMENT, check=True)
        built = list(Path(folder).rglob("*.html"))
        for page in built:
            if loaded := _LOADED.search(page.read_text()):
                raise SystemExit(f"docs: {page.name} loads {loaded[0]}")
    print(f"docs: {len(built)} pages built", flush=True)


def main() -> None:
    """Run the requested pages; fail if a full run has no block to run."""
    asked = [Path(page).resolve() for page in sys.argv[1:]]
    if not asked:
        build()
    seconds: dict[str, float] = {}
    left = 0
    # a process for each, as each counts its children's seconds
    with tempfile.TemporaryDirectory() as compiled, ProcessPoolExecutor() as pool:
        # tutorials take longest and stand last: they begin, so that no core waits in the end
        futures = [pool.submit(run, page, compiled) for page in asked or pages()[::-1]]
        try:
            for future in futures:
                ran, unrun = future.result()
                seconds |= ran
                left += unrun
        finally:
            pool.shutdown(cancel_futures=True)
    if not seconds:
        raise SystemExit("docs: no block to run")
    longest = sorted(seconds, key=lambda where: -seconds[where])[:_LONGEST]
    print("docs: longest:", ", ".join(f"{where} {seconds[where]:.0f} s" for where in longest))
    print(
        f"docs: {len(seconds)} blocks ran, {left} left out with a reason;"
        f" {processor_seconds():.0f} processor seconds"
    )


if __name__ == "__main__":
    main()
