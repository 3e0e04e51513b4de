"""Lines traced in masks: thinning, the graph of the thinned pixels, and centre lines with widths."""
