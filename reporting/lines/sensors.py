"""Lines about how the range of each sensor is derived."""

from ...formats.schema.sensor_records import SensorRecord


def sensor_lines(records: list[SensorRecord]) -> list[str]:
    """Return the derivation of each sensor's range, rule by rule."""
    lines = []
    for r in records:
        lines.append(f"{r.title}: {r.range_m:.3f} m used, beam of {r.fov_deg:.3g}°. Derivation:")
        for rule in r.rules:
            basis = "" if rule.measured else " (a law, not a measurement)"
            lines.append(f"  {rule.rule}: {rule.found}: {rule.range_m:.3f} m{basis}")
        best = [
            what
            for what, found in (
                ("light", r.ambient),
                ("reflectance", r.reflectance),
                ("size", r.target_size),
            )
            if found is None
        ]
        if best:
            lines.append(f"  not given, best case assumed: {', '.join(best)}")
        lines.append(f"  source: {r.source}{'; ' + r.note if r.note else ''}")
    return lines
