"""Steps of a check in a file, as the notes of a live check state them."""

import re
from typing import Any

from ...formats.errors import shown
from .messages import StepMessage, refuse

_STEP = re.compile(r"(?P<step>self|wave|mount|before|trial)(?: (?P<number>\d{1,6}))?")


def step_note(name: str, message: StepMessage) -> dict[str, Any]:
    """Return the note of a step in file ``name``: begin or end.

    Raises:
        UserError: if the text is no step.
    """
    text = message.text.strip()
    if text == "end":
        return {"what": "end"}
    match = _STEP.fullmatch(text)
    if match is None or (match["number"] is None and match["step"] != "self"):
        where = f"{shown(message.topic)} at {message.time:.3f} s"
        found = f"the step {shown(text)}"
        wanted = "self, wave N, mount N, before N, trial N or end"
        raise refuse(name, where, found, wanted)
    return {"what": "begin", "step": match["step"], "number": int(match["number"] or 0)}
