"""Errors a user can cause, each with the exit code `r2art` ends with when it is not handled."""


class R2ArtError(ValueError):
    """Base of every error whose message alone tells the user what, why and the remedy."""

    exit_code = 2


class UsageError(R2ArtError):
    """An argument that cannot be meant: a negative focal length, an unknown category."""

    exit_code = 2


class InputError(R2ArtError):
    """Input that is unreadable or unusable: a truncated image, an unwritable folder."""

    exit_code = 3


class ModelError(R2ArtError):
    """A model file that is missing, damaged or of another format version."""

    exit_code = 4
