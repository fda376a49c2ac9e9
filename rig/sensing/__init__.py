"""What sensors tell: readings, how they err, and what is expected of mounted rings."""
