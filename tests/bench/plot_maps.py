#!/usr/bin/env python3
"""Draws what `softshadow bench --maps --csv FILE` wrote: time against error, a panel a light.

    tests/bench/plot_maps.py tests/bench/maps.csv examples/pictures/maps.svg [SCENE]

Standard library only. A line is a method from 256 to 4096 texels a side, dots grow with the map."""
import csv
import math
import sys

COLOURS = ("#1b6ca8", "#d1495b", "#2e933c", "#8e5ea2", "#e08e1b", "#4d4d4d", "#17a2a2", "#b5651d", "#c2185b",
           "#6b8e23", "#000080", "#708090", "#000000")
WIDE, TALL, LEFT, TOP, GAP, KEY = 300, 300, 70, 46, 58, 215


class Axis:
    """Powers of ten from one place to another."""

    def __init__(self, values, begin, end):
        self.low = math.floor(math.log10(min(values)))
        self.high = max(math.ceil(math.log10(max(values))), self.low + 1)
        self.begin, self.end = begin, end

    def at(self, value):
        part = (math.log10(value) - self.low) / (self.high - self.low)
        return self.begin + part * (self.end - self.begin)

    def ticks(self):
        return range(self.low, self.high + 1)


def power(n, unit):
    if unit == "ns":
        names = {0: "1 ns", 1: "10 ns", 2: "100 ns", 3: "1 us", 4: "10 us", 5: "100 us", 6: "1 ms", 7: "10 ms"}
        return names.get(n, "1e%d ns" % n)
    return ("%%.%df" % max(0, -n)) % 10 ** n


def panel(out, left, light, rows, x, y, colour):
    out.append('<text x="%d" y="%d" class="head">%s light, %.0f %% in penumbra</text>'
               % (left, TOP - 12, light, 100 * float(rows[0]["penumbra"])))
    out.append('<rect x="%d" y="%d" width="%d" height="%d" class="frame"/>' % (left, TOP, WIDE, TALL))
    for n in x.ticks():
        at = left + x.at(10 ** n)
        out.append('<path d="M%.1f %dv%d" class="grid"/>' % (at, TOP, TALL))
        out.append('<text x="%.1f" y="%d" class="tick" text-anchor="middle">%s</text>'
                   % (at, TOP + TALL + 16, power(n, "ns")))
    for n in y.ticks():
        at = y.at(10 ** n)
        out.append('<path d="M%d %.1fh%d" class="grid"/>' % (left, at, WIDE))
        if left == LEFT:
            out.append('<text x="%d" y="%.1f" class="tick" text-anchor="end">%s</text>'
                       % (left - 6, at + 4, power(n, "")))
    methods = {}
    for row in rows:
        methods.setdefault(row["method"], []).append(row)
    for name, own in methods.items():
        spots = [(left + x.at(float(r["ns_a_point"])), y.at(max(float(r["rms"]), 10 ** y.low))) for r in own]
        path = "M" + "L".join("%.1f %.1f" % spot for spot in spots)
        dash = ' stroke-dasharray="5 3"' if "(" in name else ""
        out.append('<path d="%s" fill="none" stroke="%s" stroke-width="1.4"%s/>' % (path, colour[name], dash))
        for i, spot in enumerate(spots):
            out.append('<circle cx="%.1f" cy="%.1f" r="%.1f" fill="%s"/>' % (spot + (1.6 + 0.5 * i, colour[name])))


def draw(rows, scene):
    lights = list(dict.fromkeys(row["light"] for row in rows))
    methods = list(dict.fromkeys(row["method"] for row in rows))
    colour = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(m for m in methods if "(" not in m)}
    colour.update({name: colour[name.split(" (")[0]] for name in methods if "(" in name})
    x = Axis([float(r["ns_a_point"]) for r in rows], 0, WIDE)
    y = Axis([max(float(r["rms"]), 1e-4) for r in rows], TOP + TALL, TOP)
    width, height = LEFT + len(lights) * (WIDE + GAP) + KEY, TOP + TALL + 46
    out = ['<svg xmlns="http://www.w3.org/2000/svg" width="%d" height="%d" font-family="sans-serif">'
           % (width, height),
           "<style>.frame{fill:none;stroke:#888}.grid{stroke:#ddd;stroke-width:.7}"
           ".tick{font-size:11px;fill:#444}.head{font-size:13px}.name{font-size:12px}</style>",
           '<rect width="100%" height="100%" fill="white"/>',
           '<text x="%d" y="16" class="head">%s: RMS error over all points against time a point, maps of '
           '256 to 4096 texels a side (dots grow)</text>' % (LEFT, scene)]
    for i, light in enumerate(lights):
        panel(out, LEFT + i * (WIDE + GAP), light, [r for r in rows if r["light"] == light], x, y, colour)
    for i, name in enumerate(methods):
        at = TOP + 14 + 20 * i
        left = LEFT + len(lights) * (WIDE + GAP)
        dash = ' stroke-dasharray="5 3"' if "(" in name else ""
        out.append('<path d="M%d %dh22" stroke="%s" stroke-width="2"%s/>' % (left, at - 4, colour[name], dash))
        out.append('<text x="%d" y="%d" class="name">%s</text>' % (left + 28, at, name))
    return "\n".join(out + ["</svg>", ""])


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    scene = sys.argv[3] if len(sys.argv) == 4 else rows[0]["scene"]
    rows = [row for row in rows if row["scene"] == scene]
    if not rows:
        sys.exit("%s: has no scene %s" % (sys.argv[1], scene))
    with open(sys.argv[2], "w") as file:
        file.write(draw(rows, scene))


if __name__ == "__main__":
    main()
