#!/usr/bin/env python3
"""The command line: help, exit statuses, and one clear line for everything that is asked wrongly."""
import os
import re
import subprocess

from command import LIGHT, SOFTSHADOW, SOURCE, Case, main

NUMBERS = {"--tolerance": "0.01", "--samples": "16", "--resolution": "64", "--layers": "2",
           "--depth-bias": "0.1", "--smoothie-width": "0.1", "--mask-taps": "4",
           "--max-samples": "8", "--seed": "1", "--threads": "1", "--verify=": "10", "--blur=": "4",
           "--points-ahead": "100", "--sub-lights": "2"}
NO_NUMBERS = ["", "1,5", "nan", "inf", "1e400", "3x", "0x10", "-1", "--help"]


class Usage(Case):
    def test_help(self):
        commands = re.findall(r"(?m)^  ([a-z]+) {2,}", self.good(self.run_it("--help")).decode())
        self.assertLessEqual({"query", "render", "maps", "explain", "povray", "bench", "methods", "info"},
                             set(commands))
        for arguments in [["--help"], ["-h"], ["methods", "-h"]] + [[c, "--help"] for c in commands]:
            out = self.good(self.run_it(*arguments)).decode()
            self.assertIn("Usage: softshadow", out)
            self.assertNotIn("(null)", out)
            # A line may name a folder of the installation, which is as long as it is.
            self.assertLessEqual(max(len(re.sub(r"/\S+/share/\S+", "", line)) for line in out.splitlines()), 100)
        self.assertRegex(self.good(self.run_it("--version")).decode(), r"^softshadow \d+\.\d+\.\d+\n$")

    def test_commands(self):
        self.bad(self.run_it(), 2, "a command is missing")
        self.bad(self.run_it("qeury"), 2, "did you mean query")
        self.bad(self.run_it("xyzzy"), 2, "xyzzy is no command")
        self.bad(self.run_it("methods", "file"), 2, "file")

    def test_options(self):
        self.bad(self.query("--tolernce", "1"), 2, "--tolernce is no option", "--tolerance")
        self.bad(self.query("--xyzzy"), 2, "--xyzzy is no option")
        self.bad(self.query("-x"), 2, "-x is no option")
        self.bad(self.query("--samples"), 2, "--samples", "missing")
        self.bad(self.query("--quiet=1"), 2, "--quiet", "no value")
        self.bad(self.query("--backend", "gpu"), 2, "--backend", "cpu, egl, any")
        self.bad(self.query("--stats=xml"), 2, "--stats", "table, json")
        self.bad(self.query("--method", "raytrase", stdin=b"0 0 0\n"), 2, "did you mean raytrace")
        self.bad(self.query("--method", "xyzzy", stdin=b"0 0 0\n"), 2, "xyzzy")

    def test_numbers(self):
        for option in NUMBERS:
            for text in NO_NUMBERS:
                with self.subTest(option=option, text=text):
                    given = [option + text] if option.endswith("=") else [option, text]
                    self.bad(self.query(*given, stdin=b"0 0 0\n"), 2, option.rstrip("="))
        for text in ("1", "1,2,3,4,5", "1,2,3,4,5,6,7", "1,2,3,4,5,nan", "1 2 3 4 5 6", "1,,3,4,5,6"):
            self.bad(self.query("--bounds", text), 2, "--bounds", "X0,Y0,Z0,X1,Y1,Z1")
        for text in ("1", "a/2", "1/0", "-1/2", "1/2/3", "1/2x", "/"):
            self.bad(self.query("--shard", text), 2, "--shard", "I/N")

    def test_ranges_are_the_librarys(self):
        """The last number that an option takes the library takes, too; the next is refused here, in
        words of the command line."""
        for option in sorted(set(NUMBERS) - {"--tolerance", "--samples", "--threads", "--verify="}):
            with self.subTest(option=option):
                given = lambda n: [option + n] if option.endswith("=") else [option, n]
                said = self.bad(self.query(*given("1" + 30 * "0")), 2, option.rstrip("="), "allowed")
                low, high = re.search(r"(\S+) to (\S+) (?:is|are) allowed", said).groups()
                for number in (low, high):
                    self.good(self.query(*given(number), stdin=b"9 9 0\n"))
                if high.isdigit():
                    self.bad(self.query(*given(str(int(high) + 1))), 2, option.rstrip("="), high)

    def test_blur(self):
        """Alone over as many pixels as the library blurs over, or over a number of them."""
        mask = ["--method", "penumbra-mask", "--resolution", "64", "--stats=json"]
        for blur in ([], ["--blur"], ["--blur=64"]):
            done = self.query(*mask, *blur, stdin=b"9 9 0\n0 0 0\n")
            self.assertEqual((done.returncode, done.stdout), (0, b"9 9 0 1\n0 0 0 0\n"), done.stderr)
        for wrong in ("1", "65"):
            self.bad(self.query(*mask, "--blur=" + wrong), 2, "--blur", "2 to 64")

    def test_no_option_does_nothing(self):
        """An option of other commands is none, and is not listed, where it would be without effect."""
        run = {"maps": ["-m", "hard", "-o", self.path("m.exr")],
               "explain": ["--at", "0,0,0"], "povray": ["-o", self.path("p.pov")]}
        for command, options in [("maps", ["--verify"]), ("explain", ["--verify=9"]),
                                 ("povray", ["--verify", "--stats", "--aov=depth", "--exposure=3"])]:
            shown = self.good(self.run_it(command, "--help")).decode()
            self.assertIn("--light", shown)
            for option in options:
                with self.subTest(command=command, option=option):
                    name = option.split("=")[0]
                    self.bad(self.run_it(command, self.mesh, "-l", LIGHT, *run[command], option), 2,
                             name + " is no option")
                    self.assertNotIn(name, shown)
        self.assertEqual(os.listdir(self.folder), ["mesh.obj"])

    def test_letter_of_lights(self):
        """-l is a light wherever --light is."""
        for command in re.findall(r"(?m)^  ([a-z]+) {2,}", self.good(self.run_it("--help")).decode()):
            shown = self.good(self.run_it(command, "--help")).decode()
            if "--light " in shown:
                self.assertIn("-l, --light ", shown, command)
        out = self.good(self.run_it("info", self.mesh, "-l", LIGHT)).decode()
        self.assertRegex(out, r"silhouette edges +4  from " + LIGHT)
        many = [word for _ in range(65) for word in ("-l", LIGHT)]
        for command in ("info", "query"):
            self.bad(self.run_it(command, self.mesh, *many), 2, "at most 64 lights")

    def test_lights(self):
        for text in ("", "sphere", "sphere:", "sphere:1,2,3", "sphere:1,2,3,4,5", "sphere:1,5;2,3,4",
                     "sphere:1,2,3,nan", "sphere:1,2,3,1e400", "sphere:1,2,3,4 ", "cube:1,2,3,4",
                     "disk:0,0,4,0,0,1", "rect:0,0,4,1,0,0,0,1", "sun:0,0,-1"):
            with self.subTest(light=text):
                self.bad(self.run_it("query", self.mesh, "--light", text), 2, "--light", "allowed")
        for text in ("sphere:0,0,4,-1", "disk:0,0,4,0,0,0,1", "rect:0,0,4,1,0,0,1,0,0",
                     "sun:0,0,0,1", "sun:0,0,-1,81"):
            with self.subTest(light=text):
                done = self.run_it("query", self.mesh, "--light", text, stdin=b"0 0 0\n")
                self.bad(done, 1, "--light")
        for text in (LIGHT, "disk:0,0,4,0,0,-1,.5", "rect:0,0,4,.5,0,0,0,.5,0", "sun:0,0,-1,5"):
            with self.subTest(light=text):
                out = self.good(self.run_it("query", self.mesh, "--light", text,
                                            stdin=b"0 0 0\n9 9 0\n"))
                self.assertEqual(out, b"0 0 0 0\n9 9 0 1\n")

    def test_files(self):
        self.bad(self.run_it("query", "--light", LIGHT), 2, "a mesh is missing")
        self.bad(self.run_it("query", self.mesh, stdin=b""), 2, "--light is missing")
        points = self.put("p.csv", "0 0 0\n")
        self.bad(self.query(points, "-o", points), 2, "p.csv", "input")
        self.bad(self.query(points, "-o", self.mesh), 2, "mesh.obj", "input")
        self.bad(self.query(self.mesh), 2, "mesh.obj", "no point format")
        self.bad(self.query(points, "-o", self.path("out")), 2, "no format")
        self.bad(self.query(points, "-o", self.path("out.exr")), 2, "image")
        self.bad(self.query("--output-format", "npy", stdin=b"0 0 0\n"), 2, "npy", "number of points")
        self.bad(self.query("--shard", "0/2", stdin=b"0 0 0\n"), 2, "need a file")
        self.bad(self.query("--resume", points), 2, "--resume")

    def test_profile(self):
        good, short = self.put("good", "1, 0.5 0.25\n0\n"), self.put("short", "1")
        word = self.put("word", "1 0.5 half")
        out = self.good(self.run_it("query", self.mesh, "--light", LIGHT, "--profile", good, "--method",
                                    "raytrace", stdin=b"9 9 0\n0 0 0\n"))
        self.assertEqual(out, b"9 9 0 1\n0 0 0 0\n")
        self.bad(self.query("--profile", short, stdin=b"0 0 0\n"), 1, "short", "2 or more")
        self.bad(self.query("--profile", word, stdin=b"0 0 0\n"), 1, "word", "weight 3", "half")
        self.bad(self.query("--profile", self.path("none"), stdin=b"0 0 0\n"), 1, "none")

    def test_every_field_has_an_option(self):
        with open(os.path.join(SOURCE, "lib", "softshadow.h")) as file:
            header = file.read()
        body = re.search(r"typedef struct softshadow_build \{(.*?)\n\}", header, re.S).group(1)
        body = re.sub(r"/\*.*?\*/", "", body, flags=re.S)
        fields = set(re.findall(r"(\w+)\s*;", body)) - {"struct_size"}
        self.assertGreater(len(fields), 12)
        out = self.good(self.run_it("query", "--help")).decode()
        for field in fields:
            self.assertRegex(out, "--" + field.replace("_", "-") + r"(?=\W)")

    def complete(self, *words):
        script = ('source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _softshadow; '
                  'printf "%s\\n" "${COMPREPLY[@]}"')
        return subprocess.run(["bash", "-c", script, "bash", os.path.join(SOURCE, "cli/completion/softshadow"),
                               SOFTSHADOW, *words], stdout=subprocess.PIPE, cwd=self.folder, check=True,
                              timeout=60).stdout.decode().split()

    def test_completion(self):
        self.assertIn("query", self.complete(""))
        self.assertEqual(self.complete("que"), ["query"])
        self.assertEqual(self.complete("query", "--tol"), ["--tolerance"])
        self.assertEqual(self.complete("query", "--method", "raytr"), ["raytrace"])
        self.assertEqual(self.complete("query", "--weighting", "s"), ["solid_angle"])
        self.assertEqual(self.complete("query", "--light", "su"), ["sun:"])
        self.assertEqual(self.complete("query", "me"), ["mesh.obj"])
        self.assertIn("--json", self.complete("methods", "-"))


if __name__ == "__main__":
    main()
