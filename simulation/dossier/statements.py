"""What the user of a dossier states: text that is printed as stated and not checked."""

from typing import Annotated

from pydantic import Field

from ...coverage.definitions.definition import definition
from ...coverage.definitions.records import FileRecord

_Line = Annotated[str, Field(max_length=1000)]


@definition(kw_only=True)
class ElementStatement:
    """The performance level of an element of the safety function."""

    default: _Line = ""
    """Default performance level of its safety function by ISO 10218-2:2025."""
    rating: _Line = ""
    """Performance level that its maker or a validation states, with the source."""


@definition(kw_only=True)
class Statements(FileRecord):
    """A user's statements for the dossier (TOML). A field without one is printed as open."""

    cell: _Line = ""
    """Name of the cell."""
    author: _Line = ""
    """Person or body responsible for the cell."""
    risk_assessment: _Line = ""
    """Document of the risk assessment."""
    safety_function: _Line = ""
    """Safety function that the sensors serve, and its required performance level."""
    detection_capability: _Line = ""
    """Effective detection capability d_e that was verified on the rig, with its test piece."""
    reaction_time: _Line = ""
    """Reaction time that was measured on the rig."""
    rear_access: _Line = ""
    """Measures against undetected access and presence."""
    sensor: ElementStatement = ElementStatement()
    """The sensors."""
    electronics: ElementStatement = ElementStatement()
    """The controller boards that read the sensors."""
    bus: ElementStatement = ElementStatement()
    """The bus between sensors and controller boards."""
    software: ElementStatement = ElementStatement()
    """Firmware and software from reading to command."""
    stop_input: ElementStatement = ElementStatement()
    """The robot's stop input."""
    controller: ElementStatement = ElementStatement()
    """The robot's controller with its stop function and brakes."""
