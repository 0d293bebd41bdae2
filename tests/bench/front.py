#!/usr/bin/env python3
"""Whether auto lies on the front of time and error.

    tests/bench/front.py MATRIX.csv...                        judges what `softshadow bench --csv` wrote
    tests/bench/front.py --run SOFTSHADOW [OPTION=VALUE]...   measures first

Options of --run: scenes=LIST (those that are there), lights=LIST, side=N (192), csv=FILE, which gets a
line for each row that was judged: ratios and errors, no times.

A row of auto whose RMS error over penumbrae is at most 1/64 must be on the front: no row of the same
cell that errs no more may take less time by more than a tenth, which is noise. What --run finds behind
is measured again, at most twice, and believed when it is behind each time. It takes the methods that
come near such errors, which are no map methods; a file of all methods is judged by all of them.

Exit status 0: every one is on the front; 1: some are not; 2: there is nothing to judge."""
import csv
import os
import subprocess
import sys
import tempfile

from check import Unusable, rows_of

MUST = 1 / 64  # FRONT_ERROR of cli/bench/matrix.h
NOISE = 1.1    # FRONT_NOISE
TRIES = 3
SCENES = ("triangle,leaves-2k,leaves-20k,spheres-80k,spheres-1m,bunny,dragon-11k,dragon-48k,dragon-202k,"
          "dragon-871k")
LIGHTS = "small,medium,object"
METHODS = "auto,exact,raytrace,peer"
NEEDED = ("scene", "light", "points", "method", "setting", "unit", "backend", "ns_a_point", "penumbra_rms", "rms",
          "sweep", "triangles", "penumbra", "cpu", "threads")


def read(path):
    rows = rows_of(path)
    for number, row in enumerate(rows, 2):
        missing = [name for name in NEEDED if row.get(name) is None]
        if None in row or missing:
            raise Unusable("%s: line %d is no row of softshadow bench --csv" % (path, number))
        for name in ("ns_a_point", "penumbra_rms", "rms"):
            try:
                fine = float(row[name]) >= 0  # which nan is not
            except ValueError:
                fine = False
            if not fine:
                raise Unusable("%s: line %d: %s %r is no time or error" % (path, number, name, row[name]))
    return [row for row in rows if not row["sweep"]]


def cells(rows):
    """{(scene, light, points, cpu, threads): rows} in the order of the file."""
    out = {}
    for row in rows:
        out.setdefault(tuple(row[name] for name in ("scene", "light", "points", "cpu", "threads")), []).append(row)
    return out


def error_of(row):
    """Over penumbrae, where methods differ; over all points where there are none."""
    return float(row["penumbra_rms" if float(row["penumbra"]) > 0 else "rms"])


def ahead_of(row, rows, ours=False):
    """Of the others that err no more the one that takes least, or None."""
    rivals = [other for other in rows if other is not row and not (ours and other["backend"] == "embree")
              and error_of(other) <= error_of(row)]
    return min(rivals, key=lambda other: float(other["ns_a_point"]), default=None)


def behind(row, other):
    """Its time over the other's; 0: there is no other."""
    return float(row["ns_a_point"]) / float(other["ns_a_point"]) if other else 0.0


def verdicts(rows):
    """Of each row of auto that must be on the front: (cell, row, who is ahead or None, behind, behind of ours)."""
    out = []
    for key, own in cells(rows).items():
        for row in own:
            if row["method"] != "auto" or error_of(row) > MUST:
                continue
            ahead = ahead_of(row, own)
            out.append((key, row, ahead, behind(row, ahead), behind(row, ahead_of(row, own, ours=True))))
    return out


# ---- Measuring ---------------------------------------------------------------------------------------


def measure(program, scene, light, side):
    with tempfile.TemporaryDirectory(prefix="softshadow-front-") as folder:
        path = os.path.join(folder, "new.csv")
        done = subprocess.run(
            [program, "bench", "--scenes", scene, "--lights", light, "--methods", METHODS, "--side", side,
             "--truth-points", "2048", "--truth-samples", "4096", "--csv", path], stdout=subprocess.DEVNULL)
        if done.returncode:
            raise Unusable("%s bench: exit status %d" % (program, done.returncode))
        return read(path) if os.path.exists(path) else None  # a model that is not there is left out


def least(first, second):
    """Of two measurements of a cell the verdicts where auto is less behind."""
    again = {(key, row["setting"], row["backend"]): verdict for verdict in second for key, row in [verdict[:2]]}
    out = []
    for verdict in first:
        key, row = verdict[:2]
        other = again.get((key, row["setting"], row["backend"]), verdict)
        out.append(other if other[3] < verdict[3] else verdict)
    return out


def judge_cell(program, scene, light, side):
    told = None
    for turn in range(TRIES):
        rows = measure(program, scene, light, side)
        if rows is None:
            print("%s: left out, it is not there" % scene, flush=True)
            return []
        told = least(told, verdicts(rows)) if told is not None else verdicts(rows)
        if all(verdict[3] <= NOISE for verdict in told):
            break
    for verdict in told:
        print(("%s, %s light: " % verdict[0][:2]) + sentence(verdict), flush=True)
    return told


def run(program, options):
    known = {"scenes": SCENES, "lights": LIGHTS, "side": "192", "csv": ""}
    for option in options:
        name, equals, value = option.partition("=")
        if not equals or name not in known:
            raise Unusable("%s: of %s= one is allowed" % (option, "=, ".join(known)))
        known[name] = value
    told = []
    for scene in known["scenes"].split(","):
        for light in known["lights"].split(","):
            told += judge_cell(program, scene, light, known["side"])
            if known["csv"] and told:
                write(known["csv"], told)  # whole after each cell: a run of minutes may be stopped
    return told


# ---- Telling -----------------------------------------------------------------------------------------


def sentence(verdict):
    _, row, ahead, ratio, ours = verdict
    if not ahead:
        return "auto %s (rms %.5f): no other errs so little" % (row["setting"], error_of(row))
    return "auto %s (rms %.5f) takes %.2f times as long as %s %s (rms %.5f), %.2f of the library's best" % (
        row["setting"], error_of(row), ratio, ahead["method"], ahead["setting"], error_of(ahead), ours)


def write(path, told):
    with open(path + ".new", "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(("scene", "triangles", "light", "points", "cpu", "penumbra", "setting", "rms", "front",
                      "behind", "behind_ours", "ahead", "ahead_setting"))
        for (scene, light, points, cpu, _), row, ahead, ratio, ours in told:
            out.writerow((scene, row["triangles"], light, points, cpu, "%.3f" % float(row["penumbra"]),
                          row["setting"], "%.5f" % error_of(row), int(ratio <= NOISE), "%.2f" % ratio,
                          "%.2f" % ours, ahead["method"] if ahead else "", ahead["setting"] if ahead else ""))
    os.replace(path + ".new", path)


def conclude(told):
    if not told:
        raise Unusable("no row of auto with an RMS error of at most 1/64: there is nothing to judge")
    above = [verdict for verdict in told if verdict[3] > NOISE]
    for verdict in above:
        print("BEHIND %s, %s light, %s points: %s" % (verdict[0][:3] + (sentence(verdict),)))
    bad = {verdict[0] for verdict in above}
    every = {verdict[0] for verdict in told}
    print("auto: %d of %d rows on the front (to %.0f %%), every row of %d of %d cells" % (
        len(told) - len(above), len(told), 100 * (NOISE - 1), len(every - bad), len(every)))
    return 1 if above else 0


def main(arguments):
    if not arguments or (arguments[0] == "--run" and len(arguments) < 2):
        print(__doc__, file=sys.stderr)
        return 2
    try:
        if arguments[0] == "--run":
            return conclude(run(arguments[1], arguments[2:]))
        return conclude([verdict for path in arguments for verdict in verdicts(read(path))])
    except Unusable as error:
        print("front: %s" % error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
