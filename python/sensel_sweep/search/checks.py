"""Checks that the values of a search file's keys have the kind that is needed. Every refusal names the key and what to write."""

from __future__ import annotations

import math

from .failure import Failure, nearest, refused

# Whole numbers of TOML have 64 bits.
WHOLE_LEAST, WHOLE_MOST = -(2**63), 2**63 - 1


def finite(value: object) -> float | None:
    """A number as it is used; none for what is no number, is not finite or is too large for one."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


class Checks:
    """Checks of single values of a file."""

    def __init__(self, name: str):
        self.name = name

    def refused(self, key: str, value: object, reason: str) -> Failure:
        return refused(self.name, key, value, reason)

    def known(self, where: str, table: object, keys: list[str]) -> None:
        """Refuses what is no table, and a key that is none."""
        if not isinstance(table, dict):
            raise self.refused(where, table, f"must be a table; its keys are {', '.join(keys)}")
        for key in table:
            if key not in keys:
                raise self.refused(f"{where}.{key}" if where else key, None, f"unknown key; {nearest(key, keys)}")

    def number(self, where: str, table: dict, key: str, usual, low, high):
        """A number in its range; whole where the usual one is."""
        value = table.get(key, usual)
        is_whole = isinstance(usual, int)
        is_number = isinstance(value, int) or (isinstance(value, float) and not is_whole)
        if isinstance(value, bool) or not is_number or not low <= value <= high:
            kind = "a whole number" if is_whole else "a number"
            raise self.refused(f"{where}.{key}", value, f"must be {kind} from {low} to {high}, as in {key} = {usual}")
        return value

    def switch(self, key: str, table: dict) -> bool:
        """True or false; false unless given."""
        value = table.get(key, False)
        if not isinstance(value, bool):
            shown = f'"{value}"' if isinstance(value, str) else value
            raise self.refused(key, shown, "must be a boolean: true or false, without quotes")
        return value

    def tables(self, where: str, value: object) -> list[dict]:
        """A list of tables."""
        if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
            raise self.refused(where, None, f"must be tables, as in [[{where}]]")
        return value

    def text(self, where: str, table: dict, key: str, example: str) -> str:
        """A text that must be there."""
        value = table.get(key)
        if not isinstance(value, str) or not value:
            raise self.refused(f"{where}.{key}" if where else key, value, f"must be a text, as in {key} = \"{example}\"")
        return value

    def scenario_value(self, where: str, value: object) -> None:
        """Refuses what no key of a scenario can be: numbers that are not finite or have more than 64 bits, dates and times."""
        if isinstance(value, list):
            for number, one in enumerate(value):
                self.scenario_value(f"{where}.{number}", one)
        elif isinstance(value, dict):
            for key, one in value.items():
                self.scenario_value(f"{where}.{key}", one)
        elif isinstance(value, float) and not math.isfinite(value):
            raise self.refused(where, value, "must be finite")
        elif isinstance(value, int) and not WHOLE_LEAST <= value <= WHOLE_MOST:
            raise self.refused(where, value, f"must be a whole number from {WHOLE_LEAST} to {WHOLE_MOST}")
        elif not isinstance(value, (bool, int, float, str)):
            raise self.refused(where, value, "must be a number, a text, true, false, or a list of these")

    def keys(self, where: str, value: object) -> dict:
        """Keys of a scenario by dotted path: nested tables and dotted keys say the same."""
        if not isinstance(value, dict):
            raise self.refused(where, value, 'must be a table, as in set = { "sensor.adc.bits" = 8 }')
        flat: dict = {}
        for key, inner in value.items():
            if isinstance(inner, dict):
                flat.update({f"{key}.{rest}": one for rest, one in self.keys(f"{where}.{key}", inner).items()})
            else:
                self.scenario_value(f"{where}.{key}", inner)
                flat[key] = inner
        return flat

    def levels(self, where: str, value: object) -> tuple:
        """Names with the keys that each sets."""
        found = []
        for number, table in enumerate(self.tables(where, value)):
            self.known(f"{where}.{number}", table, ["name", "set"])
            name = self.text(f"{where}.{number}", table, "name", "walk")
            found.append((name, self.keys(f"{where}.{number}.set", table.get("set", {}))))
        self.refuse_twins(where, [name for name, _ in found])
        return tuple(found)

    def trajectories(self, where: str, value: object) -> tuple:
        """Levels of the trajectory, at least one."""
        found = self.levels(where, value)
        if not found:
            raise self.refused(where, value, f"give at least one [[{where}]] with name and set, or leave it out")
        return found

    def refuse_twins(self, where: str, names: list, advice: str = "give each its own name") -> None:
        twins = [name for number, name in enumerate(names) if name in names[:number]]
        if twins:
            raise self.refused(where, twins[0], f"stands there twice; {advice}")
