"""Lines about the upper bound on every layout of the same budget."""

from ...formats.schema.gap_models import GapModel


def gap_line(gap: GapModel | None) -> str | None:
    """Return how far the best layout may be; None if no bound was requested."""
    if gap is None:
        return None
    if gap.bound_percent is None or gap.gap_points is None:
        return "Optimality gap: interrupted before there was an upper bound."
    if not gap.informative:
        return (
            "Optimality gap: the upper bound says nothing here; it is 100 %. The sensors could"
            " cover all of the target if their beams never had to overlap."
        )
    return (
        f"Optimality gap: at most {gap.gap_points:.2f} points. No layout within the same budget and"
        f" rules covers more than {gap.bound_percent:.2f} %, wherever its rings sit"
        f" ({gap.seconds:.0f} s)."
    )
