"""Firmware of rings: controller boards and their pins, the I2C bus, and the sketch of each ring."""
