"""What real mounts and a scene's rules allow."""
