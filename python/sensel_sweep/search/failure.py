"""What ends a search, in one line."""

from __future__ import annotations

import difflib
import json

# Characters of a wrong value that a message shows.
SHOWN_MOST = 80


def one_line(text: str) -> str:
    """A text that stays on its line, also in a comment: line breaks, control characters and bytes that are no UTF-8 are escaped."""
    return "".join(one if one.isprintable() else json.dumps(one)[1:-1].replace("\x7f", "\\u007f") for one in text)


class Failure(Exception):
    """A message for the user, and the exit code that `sensel` has for its kind."""

    def __init__(self, message: str, code: int = 2):
        super().__init__(one_line(message))
        self.code = code


def refused(file: str, key: str, value: object, reason: str) -> Failure:
    """A value of the search file that cannot be; the reason names one that can."""
    text = str(value)
    shown = "" if value is None else f" = {text if len(text) <= SHOWN_MOST else text[:SHOWN_MOST] + '...'}"
    return Failure(f"{file}: {key}{shown}: {reason}")


def damaged(path: object, advice: str) -> Failure:
    """A file of a search's folder that cannot be read."""
    return Failure(f"{path}: is damaged; {advice}")


def nearest(word: str, known: list[str]) -> str:
    """The known word that is most like an unknown one, or all of them."""
    near = difflib.get_close_matches(word, known, n=1)
    return f"did you mean '{near[0]}'?" if near else f"known: {', '.join(sorted(known))}"
