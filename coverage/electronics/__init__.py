"""Electronics of a ring: controllers, drivers, the I2C bus, and how many sensors it carries."""
