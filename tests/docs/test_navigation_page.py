"""The page on navigation says what the code does."""

import re
from pathlib import Path

import pytest

from motm_wbc.basenav import TebParameters
from motm_wbc.errors import InputError
from motm_wbc.experiments.nav.request import base_of
from motm_wbc.experiments.nav.result import DriveResult

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "navigation.md").read_text()


def test_every_parameter_of_the_band_is_in_its_table():
    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) \| (.*) \|$", PAGE, re.M)
    told = {name: (float(default), meaning) for name, default, meaning in rows}
    true = {
        name: (field.default, " ".join(str(field.description).split()))
        for name, field in TebParameters.model_fields.items()
    }
    assert told == true


def test_every_figure_of_a_drive_is_explained():
    for name in set(DriveResult.__slots__) - {"global_path", "trajectory"}:
        assert f"`{name}`" in PAGE, name


@pytest.mark.parametrize("name", ["v_max", "v_reverse", "omega_max", "a_max", "alpha_max"])
def test_limits_are_refused_where_the_page_says(name):
    low, high = re.search(r"limits outside ([\d.]+)\.\.(\d+)", PAGE).groups()
    for value in (float(low), float(high)):
        assert getattr(base_of("frankie", None, {name: value}).limits, name) == value
    for value in (0.99 * float(low), 1.01 * float(high)):
        with pytest.raises(InputError, match=re.escape(f"{low}..{high}")):
            base_of("frankie", None, {name: value})
