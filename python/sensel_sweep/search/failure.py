"""What ends a search, in one line."""

from __future__ import annotations

import difflib


class Failure(Exception):
    """A message for the user, and the exit code that `sensel` has for its kind."""

    def __init__(self, message: str, code: int = 2):
        super().__init__(message)
        self.code = code


def refused(file: str, key: str, value: object, reason: str) -> Failure:
    """A value of the search file that cannot be; the reason names one that can."""
    shown = "" if value is None else f" = {value}"
    return Failure(f"{file}: {key}{shown}: {reason}")


def nearest(word: str, known: list[str]) -> str:
    """The known word that is most like an unknown one, or all of them."""
    near = difflib.get_close_matches(word, known, n=1)
    return f"did you mean '{near[0]}'?" if near else f"known: {', '.join(sorted(known))}"
