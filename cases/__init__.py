"""The ground floor of both engines."""

from cases.programs import alone

alone()
