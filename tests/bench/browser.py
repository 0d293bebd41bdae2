#!/usr/bin/env python3
"""A page as Chromium shows it: what it loads and complains of, and a picture of it.

    tests/bench/browser.py PAGE.html PICTURE.png [light|dark [WIDTH]]

Speaks the DevTools protocol through two pipes. Standard library only."""
import base64
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time

FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--disable-dev-shm-usage", "--remote-debugging-pipe"]

# What a reader would notice.
LOOK = """(() => {
  const images = [...document.images], drawings = [...document.querySelectorAll('svg')];
  return {
    title: document.title,
    images: images.length,
    decoded: images.filter(i => i.complete && i.naturalWidth > 0 && i.getBoundingClientRect().width > 0).length,
    drawings: drawings.length,
    drawn: drawings.filter(d => d.getBoundingClientRect().height > 0 && d.getBBox().width > 0).length,
    wide: document.documentElement.scrollWidth, window: document.documentElement.clientWidth,
    high: document.documentElement.scrollHeight,
    outside: performance.getEntriesByType('resource').map(e => e.name).filter(n => !n.startsWith('data:')),
    text: document.body.innerText.length,
  };
})()"""


def program():
    return shutil.which("chromium") or shutil.which("chromium-browser")


class Browser:
    """with Browser() as browser: browser.open(path) ..."""

    def __enter__(self):
        self.profile = tempfile.mkdtemp(prefix="softshadow-browser-")
        theirs_in, self.to = os.pipe()
        self.back, theirs_out = os.pipe()
        # It reads from 3 and writes to 4, whatever numbers the pipes got here.
        shell = 'exec "$0" "$@" 3<&%d 4>&%d' % (theirs_in, theirs_out)
        self.process = subprocess.Popen(
            ["bash", "-c", shell, program()] + FLAGS + ["--user-data-dir=" + self.profile, "about:blank"],
            pass_fds=(theirs_in, theirs_out), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        os.close(theirs_in)
        os.close(theirs_out)
        self.count, self.held, self.events, self.session = 0, b"", [], None
        pages = [t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page"]
        self.session = self.call("Target.attachToTarget", targetId=pages[0]["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        return self

    def __exit__(self, *_):
        os.close(self.to)
        os.close(self.back)
        self.process.kill()
        self.process.wait()
        for _ in range(20):  # its children take a moment to end
            shutil.rmtree(self.profile, ignore_errors=True)
            if not os.path.exists(self.profile):
                break
            time.sleep(.1)

    def receive(self, until):
        while b"\0" not in self.held:
            if not select.select([self.back], [], [], max(0, until - time.monotonic()))[0]:
                raise TimeoutError("Chromium says nothing")
            data = os.read(self.back, 1 << 16)
            if not data:
                raise EOFError("Chromium has ended")
            self.held += data
        message, _, self.held = self.held.partition(b"\0")
        return json.loads(message)

    def call(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.to, data):]
        until = time.monotonic() + 90
        while True:
            answer = self.receive(until)
            if answer.get("id") != self.count:
                self.events.append(answer)
            elif "error" in answer:
                raise RuntimeError("%s: %s" % (method, answer["error"]))
            else:
                return answer["result"]

    def open(self, path, width=1280, dark=False):
        """What LOOK finds, and "complaints": errors of the console, of scripts and of loading."""
        self.events = []
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        self.call("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        self.call("Page.navigate", url="file://" + os.path.abspath(path))
        until = time.monotonic() + 90
        while not any(e.get("method") == "Page.loadEventFired" for e in self.events):
            self.events.append(self.receive(until))
        seen = self.call("Runtime.evaluate", expression=LOOK, returnByValue=True)["result"]["value"]
        asked = [e["params"]["request"]["url"] for e in self.events
                 if e.get("method") == "Network.requestWillBeSent"]
        seen["asked"] = [url for url in asked if not url.startswith(("file://", "data:"))]
        seen["complaints"] = [e for e in self.events if e.get("method") in
                              ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Network.loadingFailed",
                               "Log.entryAdded")]
        return seen

    def picture(self, high=None):
        """A PNG of the window, or of so much of the page."""
        clip = {}
        if high:
            width = self.call("Page.getLayoutMetrics")["cssLayoutViewport"]["clientWidth"]
            clip = {"clip": {"x": 0, "y": 0, "width": width, "height": high, "scale": 1},
                    "captureBeyondViewport": True}
        return base64.b64decode(self.call("Page.captureScreenshot", format="png", **clip)["data"])


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    with Browser() as browser:
        seen = browser.open(sys.argv[1], int((sys.argv[4:] or ["1280"])[0]), sys.argv[3:4] == ["dark"])
        with open(sys.argv[2], "wb") as file:
            file.write(browser.picture(min(seen["high"], 16000)))
    print(json.dumps(seen, indent=1))


if __name__ == "__main__":
    main()
