"""Batches: what is wanted, the jobs that follow from it, the workers that do them, and how far they have come."""
