#!/usr/bin/env python3
"""Makes one page of what `softshadow bench` wrote into a folder.

    tests/bench/report.py FOLDER

FOLDER holds matrix.csv and, if they were made, sweep.csv, pictures.csv and pictures/. It
gets report.html, which needs nothing but itself, and plots/. Needs gnuplot; else the standard library."""
import base64
import csv
import html
import math
import os
import platform
import shutil
import sys
import time

import front
import plots

HERE = os.path.dirname(os.path.abspath(__file__))


def read(folder, name):
    try:
        with open(os.path.join(folder, name), newline="") as file:
            return list(csv.DictReader(file))
    except FileNotFoundError:
        return []


def cells(rows):
    """{(scene, light, points): rows} in the order of the file."""
    out = {}
    for row in rows:
        out.setdefault((row["scene"], row["light"], row["points"]), []).append(row)
    return out


# ---- Words -----------------------------------------------------------------------------------------


def esc(text):
    return html.escape(str(text))


def duration(ns):
    for unit, size in (("ms", 1e6), ("µs", 1e3)):
        if ns >= size:
            return "%.3g %s" % (ns / size, unit)
    return "%.3g ns" % ns


def size(count):
    count = float(count)
    for unit, one in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= one:
            return "%.3g %s" % (count / one, unit)
    return "%.0f B" % count


def thousands(count):
    return "{:,}".format(int(float(count)))


def plural(count, thing):
    return "%s %s%s" % (thousands(count), thing, "" if count == "1" else "s")


def of_cell(key, row):
    scene, light, points = key
    return "%s, %s light%s%s" % (scene, light, "" if points == "camera" else ", %s points" % points,
                                 "" if row["cpu"] == "best" else ", " + row["cpu"])


def setting(row):
    return row["setting"] if row["unit"] == "tolerance" else "%s %s" % (row["setting"], row["unit"])


def table(head, rows, classes=None):
    """Cells that begin with < are HTML already."""
    def cell(tag, text):
        return "<%s>%s</%s>" % (tag, text if str(text).startswith("<") else esc(text), tag)
    out = ['<div class="wide" tabindex="0"><table><thead><tr>',
           "".join(cell("th", text) for text in head), "</tr></thead><tbody>"]
    for i, row in enumerate(rows):
        out.append('<tr class="%s">' % (classes[i] if classes else ""))
        out.append("".join(cell("td", text) for text in row) + "</tr>")
    return "".join(out) + "</tbody></table></div>"


# ---- What follows from the rows ---------------------------------------------------------------------


def at_error(rows, error):
    """The time at which a list of rows reaches an error: along lines of logarithms; None: never."""
    ways = sorted((float(r["ns_a_point"]), float(r["penumbra_rms"])) for r in rows)
    for i, (ns, rms) in enumerate(ways):
        if rms > error:
            continue
        if i == 0 or ways[i - 1][1] <= rms:
            return ns
        before = ways[i - 1]
        part = math.log(before[1] / error) / math.log(before[1] / rms)
        return before[0] * (ns / before[0]) ** part
    return None


def peer_at(rows, error):
    """The time that the better of Embree's two ways takes to an error."""
    times = [at_error([r for r in rows if r["method"] == peer], error) for peer in ("peer", "peer adaptive")]
    return min((t for t in times if t), default=None)


def against_peer(rows):
    """Embree's time over auto's at auto's error, for the tolerance in the middle."""
    automatic = [r for r in rows if r["method"] == "auto"]
    if not automatic:
        return None
    row = automatic[len(automatic) // 2]
    theirs = peer_at(rows, float(row["penumbra_rms"]))
    return theirs / float(row["ns_a_point"]) if theirs else None


# ---- Parts of the page ------------------------------------------------------------------------------


def drawn(plot, folder, title, caption):
    svg = plots.inline(plot.draw(folder), plot.name, esc(title))
    return "<figure><b>%s</b>%s<figcaption>%s</figcaption></figure>" % (esc(title), svg, esc(caption))


def legend(rows):
    out = []
    for method in plots.by_method(rows):
        colour, _, dashed = plots.style(method)
        label = {"peer": "peer (Embree, every ray)", "peer adaptive": "peer adaptive (Embree, the rim first)"}
        out.append('<li><i %sstyle="border-color: %s"></i>%s</li>' % (
            'class="dashed" ' if dashed else "", colour, esc(label.get(method, method))))
    return '<ul class="legend">%s</ul>' % "".join(out)


def facts(matrix, sweep):
    told = front.verdicts(matrix)
    fine = sum(behind <= front.NOISE for _, _, _, behind, _ in told)
    automatic = [row for row in matrix if row["method"] == "auto"]
    ratios = [ratio for ratio in (against_peer(rows) for rows in cells(matrix).values()) if ratio]
    items = []
    if told:
        items.append(("%d of %d" % (fine, len(told)),
                      "rows of auto on or below the front of everything, Embree included"))
    if ratios:
        count = len(cells(matrix))
        where = "" if len(ratios) == count else ", in the %d of %d cells where it gets there" % (len(ratios), count)
        items.append(("%.2g–%.2g×" % (min(ratios), max(ratios)),
                      "Embree's time over auto's at the error that auto has" + where))
    if automatic:
        items.append(("%.4f" % max(float(row["max"]) for row in automatic),
                      "the largest error of auto at any point and tolerance"))
    items.append(("±%.5f" % max(float(row["truth_error"]) for row in matrix),
                  "RMS error of the truth itself, at most"))
    items.append((thousands(len(matrix) + len(sweep)), "measurements: methods × settings × scenes × lights"))
    return '<div class="facts">%s</div>' % "".join(
        '<div class="fact"><b>%s</b><span>%s</span></div>' % (esc(number), esc(text)) for number, text in items)


def fronts(matrix, folder):
    out = []
    for i, (key, rows) in enumerate(cells(matrix).items()):
        first = rows[0]
        caption = "%s, %s points, %.0f %% in penumbra; truth %s, ±%.5f" % (
            plural(first["triangles"], "triangle"), thousands(first["count"]), 100 * float(first["penumbra"]),
            "by brute force in double" if first["truth"] == "brute force" else "by rays of another sequence",
            float(first["truth_error"]))
        plot = plots.front("front-%s" % "-".join(key), rows, matrix)
        out.append(drawn(plot, folder, of_cell(key, first), caption))
    return '<div class="plots">%s</div>' % "".join(out)


def front_table(matrix):
    rows = []
    for key, row, ahead, behind, ours in front.verdicts(matrix):
        good = behind <= front.NOISE
        by = "%s, %s" % (plots.name_of(ahead), setting(ahead)) if ahead else "none"
        pill = ("good", "on the front") if good else ("bad", "behind")
        rows.append([of_cell(key[:3], row), row["setting"], "%.5f" % float(row["penumbra_rms"]),
                     duration(float(row["ns_a_point"])),
                     by,
                     "%.2f" % behind if behind else "–", "%.2f" % ours if ours else "–",
                     '<span class="pill %s">%s</span>' % pill])
    return table(["scene, light", "asked for", "RMS error", "time a point", "fastest of those that err no more",
                  "auto's time over its", "over the library's best", "verdict"], rows)


def full_tables(matrix):
    out = []
    head = ["method", "setting", "on", "time a point", "RMS, penumbra", "RMS, all", "99 % within", "largest",
            "bias", "exact", "build, ms", "for the meshes, ms", "held"]
    for key, rows in cells(matrix).items():
        body = [[row["method"], setting(row), row["backend"], duration(float(row["ns_a_point"])),
                 "%.5f" % float(row["penumbra_rms"]), "%.5f" % float(row["rms"]), "%.4f" % float(row["p99"]),
                 "%.4f" % float(row["max"]), "%+.5f" % float(row["bias"]), "%.1f %%" % float(row["exact_percent"]),
                 "%.1f" % float(row["build_ms"]), "%.1f" % float(row["prepare_ms"]), size(row["bytes"])]
                for row in rows]
        classes = [("front " if row["front"] == "1" else "") + ("auto" if row["method"] == "auto" else "")
                   for row in rows]
        out.append("<details><summary>%s</summary>%s</details>" % (
            esc(of_cell(key, rows[0])), table(head, body, classes)))
    return "".join(out)


def picture(path):
    with open(path, "rb") as file:
        return "data:image/png;base64," + base64.b64encode(file.read()).decode()


def pictures(folder, rows):
    """The truth of each cell, then every method's errors there."""
    out = []
    for key, own in cells(rows).items():
        base = os.path.join(folder, "pictures", "%s-%s-" % key[:2])
        named = [("truth", "What the camera sees", "white sees the whole light, black none of it")]
        for row in own:
            name = plots.name_of(row).replace(" on egl", " egl").translate({40: None, 41: None, 32: "-"})
            named.append((name, plots.name_of(row), "RMS %.4f, largest %.2f; %s" % (
                float(row["rms"]), float(row["max"]), duration(float(row["ns_a_point"])))))
        figures = ["<figure><img src='%s' alt='%s'><b>%s</b><figcaption>%s</figcaption></figure>" % (
            picture(base + name + ".png"), esc("%s: %s" % (of_cell(key, own[0]), title)), esc(title), esc(caption))
            for name, title, caption in named]
        out.append("<h3>%s</h3><div class='pictures'>%s</div>" % (esc(of_cell(key, own[0])), "".join(figures)))
    return "".join(out)


def growths(sweep, folder):
    out = []
    for _, title, rows, drawings in plots.sweeps(sweep):
        scene = "%s, %s" % ("bumpy spheres" if rows[0]["sweep"] == "triangles" else rows[0]["scene"],
                            "lights of many sizes" if rows[0]["sweep"] == "light" else "%s light" % rows[0]["light"])
        figures = [drawn(plot, folder, plot.title[0].upper() + plot.title[1:], scene) for plot in drawings]
        out.append("<h3>%s</h3><div class='plots'>%s</div>" % (esc(title), "".join(figures)))
    return "".join(out)


def ratio_table(matrix):
    """Times at the errors that auto was asked for; auto's own where it keeps what was asked."""
    rows = []
    for key, own in cells(matrix).items():
        exact = [r for r in own if r["method"] == "exact" and r["backend"] == "cpu"]
        for row in (r for r in own if r["method"] == "auto"):
            error = 1 / float(row["setting"].split("/")[1])
            auto = float(row["ns_a_point"]) if float(row["penumbra_rms"]) <= error else None
            ours, theirs = at_error(exact, error), peer_at(own, error)
            ratios = ["%.2f" % (theirs / t) if theirs and t else "–" for t in (auto, ours)]
            rows.append([of_cell(key, row), row["setting"]]
                        + [duration(t) if t else "not reached" for t in (theirs, auto, ours)] + ratios)
    return table(["scene, light", "at error", "Embree", "auto", "exact", "Embree over auto", "Embree over exact"], rows)


def processor():
    try:
        with open("/proc/cpuinfo") as file:
            models = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
        return "%d × %s" % (len(models), models[0])
    except (OSError, IndexError):
        return platform.machine()


HOW = """<p>Times are of one thread's processor time (on a GPU wall time), medians of turns in which everything
that errs at most 1/64 runs once after the other, so that other work on the machine meets all alike; what errs more
is timed by itself; of several threads the least of seven wall times. Only ratios carry over to other machines. Errors are taken at points of the camera's picture
against a truth that neither side made: brute force in double where the triangles are few, else rays of another
sequence; the difference of its two halves tells the truth's own error. <em>In penumbra</em> counts the points that
see a part of the light and not all of it. <em>Exact</em> is the share of points within 1/512, which no 8-bit picture
tells from the truth. <em>For the meshes</em> is what is made once and kept when the light moves; <em>build</em> is
made again. The <em>front</em> is made of all that no other beats in time without a larger error; two timings of the
same work differ by up to 10 %, so <em>auto</em> is called behind from there on.</p>"""


def page(folder):
    matrix, sweep = read(folder, "matrix.csv"), read(folder, "sweep.csv")
    shown = read(folder, "pictures.csv")
    if not matrix:
        sys.exit("%s/matrix.csv: has no rows; softshadow bench --csv writes it" % folder)
    target = os.path.join(folder, "plots")
    os.makedirs(target, exist_ok=True)
    parts = [("front", "Time against error",
              "<p>Down and left is better. The pale steps are the front. A line is a method from its coarsest setting "
              "to its finest; both axes are the same in all plots.</p>" + legend(matrix) + fronts(matrix, target)),
             ("auto", "Is auto on the front?",
              "<p>The default method must take no longer than anything else that errs as little, wherever it errs at "
              "most 1/64.</p>" + front_table(matrix))]
    if any(row["method"] == "auto" for row in matrix) and any(row["backend"] == "embree" for row in matrix):
        parts.append(("ratios", "Embree at equal error",
                      "<p>Times at which each first errs no more than asked, between its counts as straight lines of "
                      "logarithms. Where the cheapest way of one is better than asked, that one's time stands.</p>"
                      + ratio_table(matrix)))
    if shown:
        parts.append(("pictures", "Where the errors are",
                      "<p>Each pixel's error by its square root, so that a small one is seen beside a large one; grey is "
                      "none.</p><p class='scale'>too dark by 1 <i></i> too light by 1</p>" + pictures(folder, shown)))
    if sweep:
        parts.append(("growth", "How it grows", "<p>Every method at its usual setting, while one thing grows.</p>"
                      + legend(sweep) + growths(sweep, target)))
    parts.append(("tables", "All numbers", "<p>★ is on the front.</p>" + full_tables(matrix)))
    parts.append(("how", "How it was measured", HOW))
    return document(folder, matrix, sweep, parts)


def document(folder, matrix, sweep, parts):
    with open(os.path.join(HERE, "report.css"), encoding="utf-8") as file:
        style = file.read()
    links = " ".join('<a href="#%s">%s</a>' % (name, esc(title)) for name, title, _ in parts)
    files = sorted(name for name in os.listdir(folder) if name.endswith((".csv", ".json")))
    body = "".join('<section id="%s"><h2>%s</h2>%s</section>' % part for part in parts)
    return """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Soft shadows: run time against error</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">
<style>%s</style></head><body>
<header><h1>Soft shadows: run time against error</h1>
<p class="soft">libsoftshadow's methods and Embree on the same points. %s, %s.</p>%s<nav>%s</nav></header>
<main>%s</main>
<footer>Beside this page: %s; <code>plots/</code> has every plot as SVG, as PNG and as a gnuplot script.</footer>
</body></html>
""" % (style, esc(processor()), time.strftime("%Y-%m-%d"), facts(matrix, sweep), links, body,
       ", ".join('<a href="%s">%s</a>' % (esc(name), esc(name)) for name in files))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if not shutil.which("gnuplot"):
        sys.exit("gnuplot is missing: install the Debian package gnuplot-nox")
    text = page(sys.argv[1])
    path = os.path.join(sys.argv[1], "report.html")
    with open(path + ".new", "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(path + ".new", path)
    print(path)


if __name__ == "__main__":
    main()
