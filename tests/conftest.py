"""Settings of all tests."""

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# kernels are compiled at first use: a first example may take seconds
settings.register_profile("fringetrace", deadline=None, print_blob=True)
settings.load_profile("fringetrace")


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session):
    """Compile each kernel once, on two cores, before all tests or several workers: else each worker does."""
    config = session.config
    if hasattr(config, "workerinput") or config.option.collectonly:
        return
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if not (whole or config.getoption("numprocesses", None)):
        return
    script = Path(__file__).with_name("compiled.py")
    halves = [subprocess.Popen([sys.executable, str(script), half]) for half in ("rays", "light")]
    for half in halves:
        half.wait()
