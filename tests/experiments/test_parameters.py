import pytest

from motm_wbc.errors import InputError
from motm_wbc.experiments.parameters import Parameters, make_parameters, preset_names


def test_a_parameter_is_set_by_its_path():
    made = make_parameters(settings=["reach.gain=5.5", "grasp.hover=0.08", "solver=daqp"])
    assert made.reach.gain == 5.5
    assert made.grasp.hover == 0.08
    assert made.solver == "daqp"
    assert make_parameters() == Parameters()


@pytest.mark.parametrize("name", preset_names())
def test_presets_are_legal(name):
    assert isinstance(make_parameters(name), Parameters)


def test_the_papers_preset_differs():
    paper = make_parameters("paper")
    assert paper.reach.form == "quintic"
    assert paper.placement != Parameters().placement


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("reach.gian=5", "did you mean 'gain'"),
        ("rech.gain=5", "did you mean 'reach'"),
        ("reach=5", "group of parameters"),
        ("solver.name=5", "has none inside"),
        ("reach.gain", "KEY=VALUE"),
        ("reach.gain=fast", "reach.gain"),
        ("reach.gain=-1", "greater than 0"),
        ("reach.gain=nan", "finite"),
    ],
)
def test_each_slip_is_one_clear_line(setting, expected):
    with pytest.raises(InputError) as caught:
        make_parameters(settings=[setting])
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_preset_names_the_legal_ones():
    with pytest.raises(InputError, match="ours"):
        make_parameters("best")
