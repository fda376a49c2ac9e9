"""Target volumes: one class for each kind, which is what Python users construct, what files hold,
and what makes its solid."""
