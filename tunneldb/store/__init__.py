"""Tables of the database to arrays and back; nothing is computed here."""
