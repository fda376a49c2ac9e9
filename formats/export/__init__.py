"""Exports of setups to other programs."""
