"""Transfer of a survey's rows between databases: their tables, and their references."""
