"""Scene files to begin with: each runs as it is."""

import pytest

from fringetrace.instruments.interferometer import Interferometer
from fringetrace.scenefile import files
from fringetrace.scenefile.run import run
from fringetrace.scenefile.schema import kinds, parameters
from fringetrace.scenefile.templates import template

# Waves of roundings, at most, in benches of some centimetres.
HIT = 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("name", ["free", *kinds([Interferometer])])
def test_each_template_runs_and_says_all_that_can_be_said(name, tmp_path):
    text = template(name)
    few = text.replace("[64, 64]", "[8, 8]").replace("[128, 128]", "[24, 24]")
    few = few.replace("# max_bounces = 18", "max_bounces = 7")  # of a Fizeau's ghosts
    experiment = files.parse_experiment(few, f"{name}.toml", tmp_path)
    said = list(run(experiment, tmp_path / "out"))
    ghosts = ["power is cut off"] if name == "fizeau" else []
    assert [note[:16] for what, note in said if what == "note"] == ghosts
    assert float(dict(said)["budget"].split("hit ")[1].split(",")[0]) < HIT
    assert {file.name for file in (tmp_path / "out").iterdir()} == set(experiment.outputs)
    if experiment.bench is not None:
        for parameter in parameters(kinds([Interferometer])[name]):
            assert f"{parameter} = " in text or f"[bench.{parameter}]" in text


def test_an_unknown_template_is_refused():
    with pytest.raises(ValueError, match=r"template: expected one of free, .*, did you mean 'michelson'\?"):
        template("michelsen")
