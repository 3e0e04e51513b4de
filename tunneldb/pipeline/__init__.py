"""Stages of the pipeline, the ledger that records them, and what runs them."""
