"""Draws `flowscope bench tokens --json` (on stdin) as app/tokens.svg: time against tokens, both axes logarithmic."""

import json
import math
import re
import sys

WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 640, 400, 84, 50, 20, 120
COLORS = {"mamba": "#7a3fd1", "transformer": "#d98a00"}


def read(document):
    series = {}
    for entry in document["benchmarks"]:
        if match := re.fullmatch(r"(\w+)_(\d+)_tokens", entry["name"]):
            series.setdefault(match[1], []).append((int(match[2]), entry["value"]))
    return series


def main():
    series = read(json.load(sys.stdin))
    points = [p for line in series.values() for p in line]
    low = [math.log(min(p[a] for p in points)) for a in (0, 1)]
    high = [math.log(max(p[a] for p in points)) for a in (0, 1)]

    def place(tokens, ms):
        x = LEFT + (math.log(tokens) - low[0]) / (high[0] - low[0]) * (WIDTH - LEFT - RIGHT)
        y = HEIGHT - BOTTOM - (math.log(ms) - low[1]) / (high[1] - low[1]) * (HEIGHT - BOTTOM - TOP)
        return x, y

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for tokens in sorted({p[0] for p in points}):
        x, _ = place(tokens, math.exp(low[1]))
        out.append(f'<line x1="{x:.0f}" y1="{TOP}" x2="{x:.0f}" y2="{HEIGHT - BOTTOM}" stroke="#ddd"/>')
        out.append(f'<text x="{x:.0f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{tokens}</text>')
    for exponent in range(math.ceil(low[1] / math.log(10)), math.floor(high[1] / math.log(10)) + 1):
        _, y = place(math.exp(low[0]), 10.0**exponent)
        out.append(f'<line x1="{LEFT}" y1="{y:.0f}" x2="{WIDTH - RIGHT}" y2="{y:.0f}" stroke="#ddd"/>')
        out.append(f'<text x="{LEFT - 8}" y="{y + 4:.0f}" text-anchor="end">{10**exponent:g} ms</text>')
    for name, line in series.items():
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in (place(*p) for p in sorted(line)))
        color = COLORS.get(name, "#444")
        out.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="2.5"/>')
        x, y = place(*max(line))
        out.append(f'<text x="{x + 8:.0f}" y="{y + 4:.0f}" fill="{color}">{name}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2:.0f}" y="{HEIGHT - 12}" text-anchor="middle">tokens</text></svg>')
    print("\n".join(out))


if __name__ == "__main__":
    main()
