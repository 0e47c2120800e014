"""A lab on paper: what students get, with its pictures, and lines to write answers on (`labkit handout`)."""
