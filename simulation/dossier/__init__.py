"""The dossier: what is known, assumed and open about separation, detection and access."""
