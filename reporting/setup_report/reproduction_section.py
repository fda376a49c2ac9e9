"""Section of a report on how to repeat its search, its counts and their proof."""

import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence

from ..pages import code, command, escaped
from .facts import Facts

# options of the report that verify does not take, and flags without a value
_ASKED = (
    "--target",
    "--radius",
    "--draws",
    "--seed",
    "--voxel",
    "--out",
    "--require",
    "--revision",
)
_FLAGS = ("--pdf", "--json")


def _listed_versions(versions: Mapping[str, str]) -> str:
    return escaped(", ".join(f"{name} {number}" for name, number in versions.items()))


def reproduction_section(
    f: Facts, words: Sequence[str], versions: Mapping[str, str]
) -> Iterator[str]:
    """Yield the commands of the search, of this report, and of a proof of ζ.

    Args:
        f: counts of the setup.
        words: words of this report's command line.
        versions: versions of the programs.
    """
    yield "## Reproduce\n"
    if f.found is not None:
        yield f"The placement was found {escaped(f.found.created)} with seed {f.found.seed} in"
        yield f"{f.found.seconds:.0f} s ({escaped(f.found.outcome)}), by"
        yield f"{_listed_versions(f.found.versions)}:\n"
        yield _command_of(f.found.command)
        if f.found.bound is not None:
            reached, bound = 100 * f.found.exact, 100 * f.found.bound
            yield "No layout within the budget and the rules of that search reaches more than"
            yield f"{bound:.2f} %; its answer reached {reached:.2f} %.\n"
    yield f"This report, with seed {f.options.seed} for its random draws, was created by"
    yield f"{_listed_versions(versions)}:\n"
    yield command(["place-rings", *words])
    yield "To prove a ζ, as a guaranteed interval:\n"
    target, say = f.scene.targets[0].target, ["place-rings", "verify"]
    if target.plain:
        name, r = target.key
        stated = name if r is None else f"{name}:{r:g}"
        say += [*_without(words[1:], _ASKED), "--target", stated]
    else:
        say += _without(words[1:], _ASKED[2:])
    yield command([*say, "--rule", "certified"])


def _command_of(text: str) -> str:
    """Return a recorded command as a code block; a text that is no command line stays as it is."""
    try:
        words = shlex.split(text)
    except ValueError:
        return code(text)
    return command(words) if words and shlex.join(words) == text else code(text)


def _without(words: Sequence[str], options: Collection[str]) -> Iterator[str]:
    """Yield the words of a command line without the given options and their values."""
    left = iter(words)
    for word in left:
        option, together, _ = word.partition("=")
        if option in _FLAGS:
            continue
        if option not in options:
            yield word
        elif not together:
            next(left, None)
