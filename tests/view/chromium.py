"""Where Chromium is, if anywhere, and how long it is waited for."""

import shutil

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
PATIENCE = 120_000  # ms, for a busy machine
