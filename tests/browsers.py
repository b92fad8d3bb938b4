"""Browsers that tests open pages in, without a driver: the page tells what it sees."""

import os
import shutil
import signal
import subprocess
from contextlib import contextmanager
from functools import partial

import pytest

PATIENCE = 120.0  # seconds for a browser to start and to play for one second
CHROMIUM_QUIETLY = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"),
    *("--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
)
FIREFOX_QUIETLY = (
    "app.normandy.enabled",
    "app.update.enabled",
    "browser.aboutwelcome.enabled",
    "browser.safebrowsing.malware.enabled",
    "browser.safebrowsing.phishing.enabled",
    "browser.shell.checkDefaultBrowser",
    "datareporting.policy.dataSubmissionEnabled",
    "extensions.systemAddon.update.enabled",
    "network.captive-portal-service.enabled",
    "network.connectivity-service.enabled",
    "services.settings.enabled",
)


def chromium(binary, home, url):
    return [binary, *CHROMIUM_QUIETLY, f"--user-data-dir={home}", url]


def firefox(binary, home, url):
    lines = [f'user_pref("{name}", false);\n' for name in FIREFOX_QUIETLY]
    (home / "user.js").write_text("".join(lines))
    return [binary, "--headless", "--no-remote", "--profile", str(home), url]


def browser(command_for, *names):
    """A browser to test with, under the first of its names that is installed."""
    binary = next(filter(None, map(shutil.which, names)), None)
    absent = pytest.mark.skipif(
        binary is None, reason=f"there is no {' or '.join(names)} on PATH"
    )
    return pytest.param(partial(command_for, binary), id=names[0], marks=absent)


BROWSERS = [
    browser(chromium, "chromium", "chromium-browser", "google-chrome"),
    browser(firefox, "firefox", "firefox-esr"),
]


@contextmanager
def opened(command, home):
    """Run a browser in a session of its own, and end all that it starts."""
    with (home / "log").open("wb") as log:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env=os.environ | {"HOME": str(home), "MOZ_CRASHREPORTER_DISABLE": "1"},
            start_new_session=True,
        )
    try:
        yield
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
