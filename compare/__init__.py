"""The comparison."""

import cases  # noqa: F401  # begins anew where the surroundings are the caller's
