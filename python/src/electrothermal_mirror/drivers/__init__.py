"""The mirror as an instrument of the frameworks that laboratories have: one module each, which imports its framework."""
