"""The error that is the user's to mend."""


class UserError(Exception):
    """Bad input or a missing thing that the user can put right.

    The message is one clear line: what is wrong, where (file, line, value) and what to do. The command line
    prints it without a traceback and exits with code 2; every other exception is a bug and keeps its traceback.
    """
