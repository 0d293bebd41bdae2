"""Plots of what `softshadow bench` wrote, drawn by gnuplot: each as NAME.gp, which draws it again,
NAME.svg and NAME.png. Standard library only."""
import os
import re
import subprocess

# A colour that is seen on white and on black, and a gnuplot point type: filled for what traces or
# covers, see plots of `test` in gnuplot.
STYLES = {
    "auto": ("#e4572e", 13), "exact": ("#2f7fd1", 7), "raytrace": ("#22a06b", 9),
    "peer": ("#868c98", 5), "peer adaptive": ("#868c98", 4),
    "hard": ("#8e5ea2", 6), "pcf": ("#b07cc6", 6), "pcss": ("#c2783c", 8), "single-sample": ("#c9a227", 8),
    "penumbra-map": ("#17a2a2", 10), "smoothie": ("#6b8e23", 10), "penumbra-volume": ("#d16ba5", 12),
    "penumbra-mask": ("#a0623a", 12), "backprojection": ("#5f6cc9", 14), "penumbra-limit": ("#0f8f83", 15),
}
FRONT = "#c9ced8"
OTHERS = ("#b0413e", "#4c8c4a", "#7a6fd0", "#b58900")
TIMES = '("1 ns" 1, "10 ns" 10, "100 ns" 100, "1 µs" 1e3, "10 µs" 1e4, "100 µs" 1e5, "1 ms" 1e6, "10 ms" 1e7)'
ERRORS = '("10⁻⁵" 1e-5, "10⁻⁴" 1e-4, "0.001" 1e-3, "0.01" 1e-2, "0.1" 1e-1, "1" 1)'


def style(method):
    """(colour, point type, whether its line is dashed)"""
    base = method.replace(" (propagated)", "").replace(" on egl", "")
    colour, point = STYLES.get(base) or (OTHERS[sum(map(ord, base)) % len(OTHERS)], 6)
    return colour, point, base != method or base == "peer adaptive"


def name_of(row):
    return row["method"] + (" on egl" if row["backend"] == "egl" else "")


def by_method(rows):
    methods = {}
    for row in rows:
        methods.setdefault(name_of(row), []).append(row)
    return methods


class Plot:
    """Lines of points, one a method, and what else stands in the frame."""

    def __init__(self, name, x, y, settings=()):
        self.name, self.title, self.blocks, self.lines = name, y, [], []
        self.settings = ["set xlabel '%s'" % x, "set ylabel '%s'" % y] + list(settings)

    def add(self, points, how):
        """Points (x, y), drawn as gnuplot is told: "with lines ..."."""
        if points:
            self.blocks.append("$d%d << EOD\n%s\nEOD" % (
                len(self.blocks), "\n".join("%.9g %.9g" % point for point in points)))
            self.lines.append("$d%d %s" % (len(self.blocks) - 1, how))

    def add_method(self, method, points):
        colour, point, dashed = style(method)
        wide = 2.4 if method == "auto" else 1.3
        self.add(points, "with linespoints lc rgb '%s' lw %g pt %d ps %g dt %s title '%s'" % (
            colour, wide, point, 1.0 if method == "auto" else .6, "(8,5)" if dashed else "1", method))

    def script(self, folder):
        plot = "plot " + ", \\\n     ".join(self.lines)
        path = os.path.join(folder, self.name)
        return "\n".join([
            "# gnuplot %s.gp draws %s.svg and %s.png" % ((self.name,) * 3),
            "set encoding utf8", "set grid lc rgb '#9a9fa8' lw 0.3", "set border lc rgb '#868c98'",
            "set tics textcolor rgb 'black'"] + self.settings + self.blocks + [
            "set terminal svg size 520,370 dynamic font 'sans-serif,14' background 'white'",
            "set output '%s.svg'" % path, "unset key", plot,
            "set title '%s'" % self.name.replace("-", " "),
            "set terminal pngcairo size 1040,560 font 'sans,12' background 'white'",
            "set output '%s.png'" % path, "set key outside right", plot, ""])

    def draw(self, folder):
        """The SVG's text."""
        path = os.path.join(folder, self.name)
        with open(path + ".gp", "w", encoding="utf-8") as file:
            file.write(self.script(folder))
        subprocess.run(["gnuplot", path + ".gp"], check=True)
        with open(path + ".svg", encoding="utf-8") as file:
            return file.read()


def inline(svg, name, label):
    """As a part of a page: its ids its own, black the page's colour, no ground."""
    svg = svg[svg.index("<svg"):]
    svg = re.sub(r"<title>Gnuplot</title>\s*<desc>.*?</desc>", "", svg, flags=re.S)
    svg = re.sub(r'<rect x="0" y="0" width="\d+" height="\d+" fill="[^"]*"/>', "", svg, count=1)
    svg = re.sub(r"<filter.*?</filter>", "", svg, flags=re.S)
    svg = re.sub(r"""\bid=(['"])""", r"id=\1%s-" % name, svg)
    svg = re.sub(r"(xlink:href=['\"]#)", r"\1%s-" % name, svg)
    svg = re.sub(r"""(stroke|fill|color)=(['"])(black|rgb\(\s*0,\s*0,\s*0\))\2""", r"\1=\2currentColor\2", svg)
    svg = re.sub(r"(stroke='rgb\(201, 206, 216\)')", r"class='front' \1", svg)  # what FRONT is in the file
    return svg.replace("<svg", '<svg role="img" aria-label="%s"' % label, 1)


# ---- Which plots there are ------------------------------------------------------------------------


def decades(values):
    values = [value for value in values if value > 0]
    low, high = min(values), max(values)
    return "[%.3g:%.3g]" % (low / 1.6, high * 1.6)


def front(name, rows, all_rows):
    """Time against error of one cell, axes as in all cells."""
    times = [float(row["ns_a_point"]) for row in all_rows]
    errors = [max(float(row["penumbra_rms"]), 1e-5) for row in all_rows]
    plot = Plot(name, "time a point", "RMS error in penumbra", [
        "set logscale xy", "set xtics %s" % TIMES, "set ytics %s" % ERRORS,
        "set xrange %s" % decades(times), "set yrange %s" % decades(errors),
        "set arrow from graph 0, first 0.015625 to graph 1, first 0.015625 nohead lc rgb '#868c98' dt 3",
        "set label '1/64' at graph 0.985, first 0.0185 right textcolor rgb '#868c98'"])
    best = sorted((float(r["ns_a_point"]), max(float(r["penumbra_rms"]), 1e-5)) for r in rows if r["front"] == "1")
    plot.add(best, "with steps lc rgb '%s' lw 6 title 'the front'" % FRONT)
    methods = by_method(rows)
    for method in sorted(methods, key=lambda m: m == "auto"):  # on top of the others
        plot.add_method(method, [(float(r["ns_a_point"]), max(float(r["penumbra_rms"]), 1e-5))
                                 for r in methods[method]])
    return plot


X_OF = {"triangles": ("triangles", "logscale x"), "points": ("points asked at once", "logscale x"),
        "light": ("radius of the light in radii of the scene", "logscale x"),
        "threads": ("threads", "xtics 1"), "resolution": ("texels along a side of the map", "logscale x 2")}


def growth(sweep, rows, column, label, settings):
    x, scale = X_OF[sweep]
    what = {"ns_a_point": "time", "penumbra_rms": "error", "build_ms": "build"}[column]
    plot = Plot("%s-%s" % (sweep, what), x, label,
                ["set " + scale, "set logscale y"] + list(settings))
    if sweep in ("triangles", "points"):
        plot.settings.append("set xtics ('1 k' 1e3, '10 k' 1e4, '100 k' 1e5, '1 M' 1e6, '10 M' 1e7)")
    for method, own in by_method(rows).items():
        points = sorted((float(r["value"]), float(r[column])) for r in own)
        plot.add_method(method, [p for p in points if p[1] > 0])
    return plot


def speed_up(rows):
    plot = Plot("threads-speed-up", "threads", "times as fast as one thread", ["set xtics 1", "set yrange [0:*]"])
    for method, own in by_method(rows).items():
        time = {int(float(r["value"])): float(r["ns_a_point"]) for r in own}
        if 1 in time:
            plot.add_method(method, [(n, time[1] / time[n]) for n in sorted(time)])
    return plot


def sweeps(rows):
    """[(title, [plot])] of the sweeps that were made."""
    out = []
    time = ("ns_a_point", "time a point", ["set ytics %s" % TIMES])
    error = ("penumbra_rms", "RMS error in penumbra", ["set ytics %s" % ERRORS])
    build = ("build_ms", "build, ms", [])
    for sweep, title, columns in (
            ("triangles", "More triangles", [time, build]), ("points", "More points", [time]),
            ("light", "A larger light", [time, error]), ("resolution", "Finer maps", [time, error, build]),
            ("threads", "More threads", [])):
        own = [row for row in rows if row["sweep"] == sweep]
        if own:
            plots = [growth(sweep, own, *column) for column in columns]
            out.append((sweep, title, own, plots or [speed_up(own)]))
    return out
