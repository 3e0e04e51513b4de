"""The figures that README and docs state, each with the command that makes it."""
