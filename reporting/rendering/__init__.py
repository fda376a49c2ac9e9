"""Still pictures in three dimensions: solids as flat faces, painted from far to near."""
