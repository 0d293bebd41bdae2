#!/usr/bin/env python3
"""Whether the library has become slower or less exact than tests/bench/results.csv says.

    tests/bench/check.py BASE.csv NEW.csv            compares two files
    tests/bench/check.py BASE.csv --run SOFTSHADOW   measures what is cheap and compares that

Both are what `softshadow bench --peer --csv` writes. A ratio is Embree's time over ours in one run, in
turns, so that it carries from one hour to another; where it falls by more than a fifth, --run measures
that scene again, at most twice, and believes the best. Errors carry no noise: the points and the
truth's samples are the same each time. Exit status 0: no worse; 1: worse; 2: not to be compared."""
import csv
import os
import subprocess
import sys
import tempfile

KEY = ("scene", "light", "points", "cpu", "method", "tolerance")
RATIO = 0.8  # of the old ratio at least
# What an error may grow by: a twentieth, as other vector units round Embree's truth otherwise, and a
# unit of the last digit that the files have.
GROWTH, DIGIT = 1.05, {"penumbra_rms": 1e-5, "rms": 1e-5, "max": 1e-4}
# Cheap and steady: a minute for all three, and no model that must be fetched.
SCENES, LIGHTS, TOLERANCES = ("triangle", "leaves-2k", "bunny"), ("medium",), ("1/64", "1/256")
TRIES = 3


class Unusable(Exception):
    pass


def rows_of(path):
    try:
        with open(path, newline="") as file:
            return list(csv.DictReader(file))
    except OSError as error:
        raise Unusable("%s: %s" % (path, error.strerror))


def read(path):
    """{key: row}"""
    out = {}
    for number, row in enumerate(rows_of(path), 2):
        if None in row or any(row.get(name) in (None, "") for name in KEY + ("ratio",) + tuple(DIGIT)):
            raise Unusable("%s: line %d is no row of softshadow bench --peer --csv" % (path, number))
        key = tuple(row[name] for name in KEY)
        if key in out:
            raise Unusable("%s: line %d: %s is there twice" % (path, number, " ".join(key)))
        out[key] = row
    if not out:
        raise Unusable("%s: has no rows" % path)
    return out


def number(row, name):
    try:
        return float(row[name])
    except ValueError:
        raise Unusable("%s: %s %r is no number" % (" ".join(row[k] for k in KEY), name, row[name]))


def slower(old, new):
    """Why the new ratio is worse; None: it is not. nan: one side did not reach the error."""
    was, now = number(old, "ratio"), number(new, "ratio")
    if was != was:
        return None
    if now != now:
        return "the error is not reached any more (%s)" % new["ratio_is"]
    if now < RATIO * was:
        return "ratio %.2f, was %.2f: %.0f %% less, 20 %% are allowed" % (now, was, 100 * (1 - now / was))
    return None


def grown(old, new):
    out = []
    for name, digit in DIGIT.items():
        was, now = number(old, name), number(new, name)
        if not now <= GROWTH * was + digit:
            out.append("%s %.5f, was %.5f" % (name, now, was))
    return out


def compare(base, new):
    """[(key, what is worse, whether that may be noise)]"""
    out = []
    for key, old in base.items():
        if key not in new:
            raise Unusable("%s: is not in the new file" % " ".join(key))
        why = slower(old, new[key])
        if why:
            out.append((key, why, why.startswith("ratio")))
        out += [(key, why, False) for why in grown(old, new[key])]
    return out


# ---- Measuring ---------------------------------------------------------------------------------------


def rung():
    """What the base's rows for this machine say under cpu."""
    cap = os.environ.get("SOFTSHADOW_CPU")
    if cap:
        return cap
    try:
        with open("/proc/cpuinfo") as file:
            return "best" if "avx512bw" in file.read() else "avx2"
    except OSError:
        return "best"


def measure(program, scenes, lights, cpu, folder):
    path = os.path.join(folder, "new.csv")
    own = dict(os.environ)
    if cpu != "best":
        own["SOFTSHADOW_CPU"] = cpu
    done = subprocess.run(
        [program, "bench", "--peer", "--scenes", ",".join(scenes), "--lights", ",".join(lights), "--tolerances",
         ",".join(TOLERANCES), "--repeat", "3", "--csv", path], stdout=subprocess.DEVNULL, env=own)
    if done.returncode:
        raise Unusable("%s bench --peer: exit status %d" % (program, done.returncode))
    return read(path)


def better(first, second):
    """Of two measurements of the same row the one with the larger ratio."""
    a, b = number(first, "ratio"), number(second, "ratio")
    return second if a != a or b > a else first


def run(base, program):
    cpu = rung()
    base = {key: row for key, row in base.items() if row["scene"] in SCENES and row["light"] in LIGHTS
            and row["points"] == "camera" and row["cpu"] == cpu and row["tolerance"] in TOLERANCES}
    if not base:
        raise Unusable("the base has no rows for this machine's %s" % cpu)
    new, scenes = {}, sorted({key[0] for key in base}, key=SCENES.index)
    lights = sorted({key[1] for key in base}, key=LIGHTS.index)
    for turn in range(TRIES):
        with tempfile.TemporaryDirectory(prefix="softshadow-check-") as folder:
            for key, row in measure(program, scenes, lights, cpu, folder).items():
                new[key] = better(new[key], row) if key in new else row
        scenes = sorted({key[0] for key, _, noise in compare(base, new) if noise}, key=SCENES.index)
        if not scenes:
            break
        if turn + 1 < TRIES:
            print("again, it may be noise: %s" % ", ".join(scenes), flush=True)
    return base, new


def tell(base, new):
    for key, old in base.items():
        print("%-52s ratio %6.2f (was %6.2f)  rms %.5f (%.5f)  max %.4f (%.4f)" % (
            " ".join(key), number(new[key], "ratio"), number(old, "ratio"), number(new[key], "penumbra_rms"),
            number(old, "penumbra_rms"), number(new[key], "max"), number(old, "max")))


def main(arguments):
    if len(arguments) not in (2, 3) or (len(arguments) == 3) != ("--run" in arguments[1:2]):
        sys.exit(__doc__)
    try:
        base = read(arguments[0])
        base, new = run(base, arguments[2]) if len(arguments) == 3 else (base, read(arguments[1]))
        worse = compare(base, new)
        tell(base, new)
    except Unusable as error:
        print("check: %s" % error, file=sys.stderr)
        return 2
    for key, why, _ in worse:
        print("WORSE %s: %s" % (" ".join(key), why))
    print("%d of %d rows are worse" % (len({key for key, _, _ in worse}), len(base)))
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
