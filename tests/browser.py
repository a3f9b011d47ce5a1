"""A real browser for pages: headless Chromium at desktop and phone width, with their script and without.

A copy of the page is told to note every error, to act as a reader would, and to tell the page around it what it then
sees, which `--dump-dom` prints. It stands in a frame because a headless window is never narrower than 500 pixels.
"""

import html
import json
import re
import shutil
import subprocess
import threading

import pytest

from taskslam.report.loopback import LoopbackServer

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt install chromium")

DESKTOP, PHONE = (1280, 900), (390, 844)
WATCH = """<script>
const noted = [];
addEventListener("error", (event) => noted.push(event.message ?? "resource"), true);
addEventListener("securitypolicyviolation", (event) => noted.push(event.violatedDirective));
addEventListener("unhandledrejection", (event) => noted.push(String(event.reason)));
for (const name of ["error", "warn"]) {
  const original = console[name];
  console[name] = (...texts) => { noted.push(texts.join(" ")); original(...texts); };
}
</script>"""
ACT = """<script>
addEventListener("load", async () => {
  const seen = (selector) => [...document.querySelectorAll(selector)].filter((at) => at.getClientRects().length > 0);
  const text = (selector) => seen(selector).map((at) => at.innerText.trim());
  const result = await (async () => { %s })();
  parent.postMessage(JSON.stringify({ noted, result }), "*");
});
</script>"""
FRAME = """<!doctype html><pre id="result"></pre>
<script>onmessage = (event) => { document.getElementById("result").textContent = event.data; };</script>
<iframe src="acted.html" style="width: %dpx; height: %dpx; border: 0"></iframe>"""


def chromium(url, *options):
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
        "--enable-logging=stderr", "--virtual-time-budget=4000", "--window-size=1400,1000", *options, url,
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    return done.stdout, [line for line in done.stderr.splitlines() if ":CONSOLE" in line]


def without_policy(text):
    """A page whose policy, which forbids scripts of ours, is off."""
    return re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)


def served(page, acts, *options):
    """What a page becomes that is served with these acts, and what its console says."""
    with LoopbackServer(page, acts) as serving:
        thread = threading.Thread(target=serving.serve_forever)
        thread.start()
        try:
            return chromium(serving.url, "--dump-dom", *options)
        finally:
            serving.shutdown()
            thread.join()


def told_when_served(page, acts):
    """What a page, served with these acts, leaves in its element `told`: JSON."""
    dom, console = served(page, acts, "--virtual-time-budget=20000")
    found = re.search(r'<pre id="told">(.+?)</pre>', dom, re.DOTALL)
    assert found, f"the page did not finish; console: {console}"
    return json.loads(html.unescape(found.group(1)))


def act(page, size, script, *options):
    """What `script` returns in the page, which may await something; no error may have been noted.

    The page's policy, which forbids the script, is off.
    """
    text = without_policy(page.read_text(encoding="utf-8"))
    text = text.replace("<head>", f"<head>{WATCH}", 1).replace("</body>", f"{ACT % script}</body>")
    page.with_name("acted.html").write_text(text, encoding="utf-8")
    frame = page.with_name("frame.html")
    frame.write_text(FRAME % size, encoding="utf-8")
    dom, console = chromium(frame.as_uri(), "--dump-dom", *options)
    found = re.search(r'<pre id="result">(.+?)</pre>', dom, re.DOTALL)
    assert found, f"the page did not finish; console: {console}"
    report = json.loads(html.unescape(found.group(1)))
    assert report["noted"] == []
    assert console == []
    return report["result"]
