"""How the model by which dark regions are judged is made, and what it is worth."""
