"""Images of other instruments in the unrolled plane: placement, checks and resampling."""
