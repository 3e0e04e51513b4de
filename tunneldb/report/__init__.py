"""The inspection report of a survey: one HTML file that asks nothing of the network, or a PDF of it."""
