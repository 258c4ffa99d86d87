"""Draws points, lines and intervals over two axes as inline SVG whose letters are text."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from html import escape

WIDTH_PX, HEIGHT_PX = 520, 320
LEFT_PX, BOTTOM_PX, MARGIN_PX = 76, 46, 12


@dataclass
class Series:
    """Points that belong together, with the page's colour; an interval along y and x where there is one."""

    name: str
    colour: str
    points: list[tuple[float, float]]
    y_intervals: list[tuple[float, float] | None] = field(default_factory=list)
    x_intervals: list[tuple[float, float] | None] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    is_line: bool = False
    radius_px: float = 4.0


def digits(value: float | None) -> str:
    """Four significant digits."""
    return "" if value is None else f"{value:.4g}"


def ticks(low: float, high: float) -> list[float]:
    """Four to eight round numbers in a range."""
    raw = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= raw)
    first = math.ceil(low / step - 1e-9)
    return [number * step for number in range(first, math.floor(high / step + 1e-9) + 1)]


def span(values: list[float]) -> tuple[float, float]:
    """A range with room at both ends, and never empty."""
    low, high = min(values), max(values)
    room = 0.06 * (high - low) or 0.5 * abs(low) or 0.5
    return low - room, high + room


def chart(title: str, x_label: str, y_label: str, all_series: list[Series]) -> str:
    """The chart with its legend; a sentence where there is nothing to draw."""
    drawn = [one for one in all_series if one.points]
    xs = [x for one in drawn for x, _ in one.points] + [end for one in drawn for ends in one.x_intervals if ends for end in ends]
    ys = [y for one in drawn for _, y in one.points] + [end for one in drawn for ends in one.y_intervals if ends for end in ends]
    if not xs:
        return f'<p class="note">{escape(title)}: nothing was measured.</p>'
    (x_low, x_high), (y_low, y_high) = span(xs), span(ys)
    bottom, right = HEIGHT_PX - BOTTOM_PX, WIDTH_PX - MARGIN_PX

    def x_px(x: float) -> str:
        return f"{LEFT_PX + (x - x_low) / (x_high - x_low) * (right - LEFT_PX):.1f}"

    def y_px(y: float) -> str:
        return f"{bottom - (y - y_low) / (y_high - y_low) * (bottom - MARGIN_PX):.1f}"

    parts = [f'<svg viewBox="0 0 {WIDTH_PX} {HEIGHT_PX}" role="img" font-size="13"><title>{escape(title)}</title>']
    for x in ticks(x_low, x_high):
        parts.append(f'<path d="M{x_px(x)} {MARGIN_PX}V{bottom}" stroke="var(--grid)"/>')
        parts.append(f'<text x="{x_px(x)}" y="{bottom + 17}" text-anchor="middle">{x:.6g}</text>')
    for y in ticks(y_low, y_high):
        parts.append(f'<path d="M{LEFT_PX} {y_px(y)}H{right}" stroke="var(--grid)"/>')
        parts.append(f'<text x="{LEFT_PX - 6}" y="{y_px(y)}" dy="4" text-anchor="end">{y:.6g}</text>')
    parts.append(f'<path d="M{LEFT_PX} {MARGIN_PX}V{bottom}H{right}" fill="none" stroke="var(--rule)"/>')
    parts.append(f'<text x="{(LEFT_PX + right) / 2}" y="{HEIGHT_PX - 8}" text-anchor="middle">{escape(x_label)}</text>')
    middle = (MARGIN_PX + bottom) / 2
    parts.append(f'<text transform="translate(14 {middle}) rotate(-90)" text-anchor="middle">{escape(y_label)}</text>')
    for one in drawn:
        if one.is_line:
            path = "L".join(f"{x_px(x)} {y_px(y)}" for x, y in one.points)
            parts.append(f'<path d="M{path}" fill="none" stroke="{one.colour}" stroke-width="2"/>')
        for (x, y), ends in zip(one.points, one.y_intervals):
            if ends:
                parts.append(f'<path d="M{x_px(x)} {y_px(ends[0])}V{y_px(ends[1])}" stroke="{one.colour}" stroke-width="2"/>')
        for (x, y), ends in zip(one.points, one.x_intervals):
            if ends:
                parts.append(f'<path d="M{x_px(ends[0])} {y_px(y)}H{x_px(ends[1])}" stroke="{one.colour}" stroke-width="2"/>')
        for number, (x, y) in enumerate(one.points):
            parts.append(f'<circle cx="{x_px(x)}" cy="{y_px(y)}" r="{one.radius_px}" fill="{one.colour}"/>')
            if number < len(one.labels):
                parts.append(f'<text x="{x_px(x)}" y="{y_px(y)}" dx="7" dy="-6">{escape(one.labels[number])}</text>')
    parts.append("</svg>")
    entry = '<li><svg viewBox="0 0 16 16" aria-hidden="true"><circle cx="8" cy="8" r="5" fill="{}"/></svg>{}</li>'
    legend = "".join(entry.format(one.colour, escape(one.name)) for one in drawn) if len(drawn) > 1 else ""
    return f'<figure class="chart"><ul class="legend">{legend}</ul>{"".join(parts)}</figure>'
