"""A hint for angles that were given in degrees. This module imports nothing else of the project."""


def radians_hint(value: float) -> str:
    """Return the end of a message about an angle in rad beyond its limits: what would state as many
    degrees, or "" where the value is no usual number of degrees."""
    if not 2 <= abs(value) <= 720:
        return ""
    return f"; did you mean math.radians({value:g})?"
