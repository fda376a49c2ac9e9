"""The dossier as a page: tables of separation, stops, access, and elements, with a plan view."""
