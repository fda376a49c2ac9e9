"""3D rendering of still pictures: a renderer with a depth buffer, meshes and figures."""
