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
    """Before all tests compile each kernel once, on two cores: else every worker does so for itself."""
    config = session.config
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if hasattr(config, "workerinput") or not whole or config.option.collectonly:
        return
    script = Path(__file__).with_name("compiled.py")
    halves = [subprocess.Popen([sys.executable, str(script), half]) for half in ("rays", "light")]
    for half in halves:
        half.wait()
