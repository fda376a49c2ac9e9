"""Printed rings: solids, measurements, files."""
