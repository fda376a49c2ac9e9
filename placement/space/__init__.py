"""The setups that a scene's rules allow, as design vectors, and starts among them."""
