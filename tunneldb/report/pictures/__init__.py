"""Pictures that others name, photos and logos: read by processes of their own, with limits of time and memory."""
