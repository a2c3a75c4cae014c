"""Warnings are given at the caller's line, and once."""

import pytest

import fringetrace as ft
from fringetrace.core import warn, warn_once


def test_a_warning_stands_at_the_line_that_called():
    with pytest.warns(ft.FringetraceWarning, match="^too dark$") as given:
        warn("too dark")
    assert given[0].filename == __file__


def test_a_warning_is_given_once():
    known = {"noise"}
    with pytest.warns(ft.FringetraceWarning) as given:
        [warn_once({"dark": text, "noise": "noisy"}, known) for text in ("too dark", "darker")]
    assert [str(one.message) for one in given] == ["too dark"]
    assert known == {"noise", "dark"}
