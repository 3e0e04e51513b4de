"""The desk in a browser: pages, requests and tiles on top of the database, whose roles decide what is allowed."""
