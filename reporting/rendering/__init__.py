"""Still pictures in three dimensions: a renderer with a depth buffer, meshes and figures."""
