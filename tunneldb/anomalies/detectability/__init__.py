"""Detectability: which leaks detection would find in a survey, from synthetic leaks injected into its own images."""
