"""Print the result of a check."""

from collections.abc import Sequence
from pathlib import Path

from ...reporting.terminal import Terminal, say_json
from ...rig.check.assessment import Assessment
from ...rig.check.report import OPTIONAL, calibration_notes

EXIT = {"as proposed": 0, "differs": 1, "unfinished": 3}  # 2: bad input


def tell(assessment: Assessment, files: Sequence[str], folder: Path, as_json: bool) -> int:
    """Print the verdict and the files, or the result as JSON; return the exit code."""
    r = assessment.result
    if as_json:
        say_json(r.model_dump_json(indent=2))
        return EXIT[r.verdict]
    console = Terminal()
    lines = [f"{r.setup}: {r.verdict}", *(f"  {reason}" for reason in r.reasons)]
    lines += [f"  warning: {warning}" for warning in r.warnings]
    lines += calibration_notes(r)
    if r.mount is not None:
        for one in r.mount.rings:
            errors = ", ".join(map(str, one.errors)) or "not estimated"
            lines.append(f"ring {one.ring} ({one.link}): {one.verdict}; {errors}")
        lines += [
            f"coverage of {z.named}: {z.proposed_percent:.2f} % as proposed,"
            f" {z.alive_percent:.2f} %"
            " as built, with the sensors that answer"
            for z in r.mount.zeta
        ]
    for c in r.coverage:
        lines.append(
            f"test rod: detected in {c.measured} of {c.named} ({sum(c.table[0])} trials predicted"
            f" seen, {sum(c.table[1])} unseen); predicted {c.predicted_percent:.1f} %"
        )
    lines += [r.disclaimer, *(f"  {folder / name}" for name in files)]
    old = [name for name in OPTIONAL if name not in files and (folder / name).exists()]
    if old:
        lines.append(f"{folder} also holds files of an earlier check: {', '.join(old)}")
    console.lines(*lines)
    return EXIT[r.verdict]
