#!/usr/bin/env python3
"""What gcc's counters say after tests ran: the share of lines and branches of lib/ and cli/ that did.

    tests/coverage.py SOURCE BUILD [FILE]

A line that several programs or instruction-set rungs were made of ran when it ran in one of them; so
did a branch. FILE: lists the lines of that source file that never ran."""
import json
import os
import subprocess
import sys

ROOMS = ("lib", "cli")
FEW = 12  # files shown, those where most lines never ran


class Source:
    def __init__(self):
        self.lines, self.branches = {}, {}

    def add(self, entry):
        number = entry["line_number"]
        self.lines[number] = self.lines.get(number, 0) + entry["count"]
        counts = [branch["count"] for branch in entry["branches"]]
        # Where a rung has other branches than the last they are not the same ones: the fuller counts.
        old = self.branches.get(number, [])
        if len(old) == len(counts):
            self.branches[number] = [a + b for a, b in zip(old, counts)]
        elif sum(map(bool, counts)) >= sum(map(bool, old)):
            self.branches[number] = counts

    def ran(self):
        return sum(count > 0 for count in self.lines.values()), len(self.lines)

    def taken(self):
        all_of_them = [count for counts in self.branches.values() for count in counts]
        return sum(count > 0 for count in all_of_them), len(all_of_them)


def counters(build):
    for folder, _, names in os.walk(build):
        for name in names:
            if name.endswith(".gcno"):  # also of what never ran: no .gcda lies beside it
                yield os.path.abspath(os.path.join(folder, name))


def parse(text):
    for line in text.splitlines():
        if line.startswith("{"):
            yield from json.loads(line)["files"]


def collect(source, build):
    root, found = os.path.realpath(source), {}
    for path in counters(build):
        done = subprocess.run(["gcov", "--json-format", "--stdout", "--branch-probabilities", path], cwd=build,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        for file in parse(done.stdout.decode(errors="replace")):
            name = os.path.relpath(os.path.realpath(os.path.join(build, file["file"])), root)
            if name.split(os.sep)[0] not in ROOMS:
                continue
            for entry in file["lines"]:
                found.setdefault(name, Source()).add(entry)
    return found


def share(pairs):
    part, whole = (sum(numbers) for numbers in zip(*pairs))
    return "%5.1f %% of %d" % (100 * part / whole if whole else 100, whole)


def tell(found):
    for room in ROOMS:
        own = [file for name, file in found.items() if name.startswith(room + os.sep)]
        if own:
            print("%s: %s lines ran, %s branches" % (room, share([f.ran() for f in own]), share([f.taken() for f in own])))
    print("Where most lines never ran:")
    missed = sorted(found.items(), key=lambda item: item[1].ran()[0] - item[1].ran()[1])
    for name, file in missed[:FEW]:
        print("  %-36s %4d lines, %s" % (name, file.ran()[1] - file.ran()[0], share([file.ran()])))


def main(arguments):
    if len(arguments) not in (2, 3):
        print(__doc__, file=sys.stderr)
        return 2
    found = collect(arguments[0], arguments[1])
    if not found:
        print("coverage: no counters below %s" % arguments[1], file=sys.stderr)
        return 2
    if len(arguments) == 2:
        tell(found)
        return 0
    if arguments[2] not in found:
        print("coverage: %s: has no counters" % arguments[2], file=sys.stderr)
        return 2
    for number, count in sorted(found[arguments[2]].lines.items()):
        if not count:
            print("%s:%d" % (arguments[2], number))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
