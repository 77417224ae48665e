"""The one family of errors a user is meant to see; stages print them as a single line."""


class FlexikError(Exception):
    """A user's mistake or a failed computation, told in one sentence that names the culprit."""


class ParameterError(FlexikError):
    """A key of params.yaml is unknown, missing or out of range."""


class DataError(FlexikError):
    """A file is missing, damaged, or made with other parameters."""


class SolverError(FlexikError):
    """A static equilibrium was not found for a sample."""


class TrainingError(FlexikError):
    """A training run ended without a usable network."""


class UnreachableError(FlexikError):
    """A target lies outside what the strokes can reach."""
