"""A small segmentation network for wet lining: its data, its training, and what it is worth beside today's detection."""
