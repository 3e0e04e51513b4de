"""What is fixed to the lining of a synthetic tunnel, let into it, hangs in the tunnel or stands in it."""
