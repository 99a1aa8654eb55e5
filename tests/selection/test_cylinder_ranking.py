"""`pneumo study` and `pneumo init`: what is chosen, where it is written, what the template holds."""

import re

import pytest
import xarray as xr
import yaml
from bad_input import fields
from paper_study import STUDY

from pneumo.configuration.parameters import Sources, load, study
from pneumo.errors import InputError
from pneumo.notebook.model_study import ModelStudy
from pneumo.publish.pages.study_page import MARK, check_folder, save_study
from pneumo.selection.answer import answers
from pneumo.selection.cylinder_ranking import TITLE, run_study, selected, simulated_time
from pneumo.selection.cylinder_template import TEMPLATE, write_template

pytestmark = pytest.mark.xdist_group("own study")  # its fixtures take seconds


@pytest.fixture(scope="module")
def template():
    return study(load(TEMPLATE))


@pytest.fixture(scope="module")
def short(template):
    experiments = {name: e._replace(steps=300) for name, e in template.experiments.items()}
    return template._replace(experiments=experiments, n=(1.2, 1.3), seeds=2)


@pytest.fixture(scope="module")
def cells(short):
    return run_study(short, threads=2)


def test_init_writes_once(tmp_path):
    file = tmp_path / "new" / "my.yaml"
    write_template(file)
    assert file.read_bytes() == TEMPLATE.read_bytes()
    for wrong, words in ((file, r"my\.yaml: already exists"), (file / "below.yaml", "cannot be written")):
        with pytest.raises(InputError, match=words):
            write_template(wrong)
    assert file.read_bytes() == TEMPLATE.read_bytes()


@pytest.fixture
def with_options():
    """The template with every line that is commented out."""
    return yaml.safe_load(re.sub(r"#~ ?", "", TEMPLATE.read_text()))


def test_template_holds_every_key_and_right_options(with_options):
    def keys_of(node):
        for key, value in node.items():
            yield key
            if isinstance(value, dict):
                yield from keys_of(value)

    known = {key for path, _ in fields() for key in path} - {"NAME"}
    of_fits = {"fitted", "quantities", "covariance", "error_kPa", "sag"}  # `pneumo fit` writes these
    assert sorted(known - of_fits - set(keys_of(with_options))) == []
    # What excludes one another: the rest of one kind goes.
    mine, closed = with_options["cylinders"]["mine"], with_options["experiments"]["closed"]
    del mine["k_x_k_u_m2_per_V"], mine["closed_loop"]["variance_m2"]
    mine["valve"] = {key: mine["valve"][key] for key in ("C_dm3_per_sbar", "b")}
    del with_options["experiments"]["open"]["lambda_0_W_per_m2K"]
    for key in ("levels", "hold_s", "file", "column"):
        del closed["signal"][key]
    parsed = study(Sources(with_options).validated())
    assert parsed.experiments["closed"].excitation.signal == "sweep"
    assert parsed.experiments["open"].push.force == -300.0
    assert parsed.levels == {"mine": (0.3,)}


def test_choice_of_cylinders_and_experiments_and_their_simulated_time(template):
    assert list(selected(template).experiments) == ["open", "closed"]
    assert list(selected(template, ["mine"], ["closed"]).experiments) == ["closed"]
    wrong = (template, ["theirs"], [], "cylinder = 'theirs'"), (template, [], ["half"], "experiment = 'half'")
    for whole, cylinder, experiment, words in (*wrong, (STUDY, ["E"], ["E02"], "none of the named")):
        with pytest.raises(InputError, match=words):
            selected(whole, cylinder, experiment)
    assert simulated_time(template) == pytest.approx(2 * 5 * 20)
    e = template.experiments["open"]
    fixed = e._replace(excitation=e.excitation._replace(signal="levels", levels=(1.0,)))
    assert simulated_time(template._replace(experiments={"open": fixed})) == pytest.approx(20)


@pytest.mark.slow
def test_files_of_a_study(short, cells, tmp_path):
    found = answers(cells)
    assert [answer.ranking.cylinder for answer in found] == ["mine"]
    check_folder(tmp_path / "out")
    page, stored = save_study(short, cells, found, tmp_path / "out")
    assert MARK in page.read_text()[:1000]
    with xr.open_dataset(stored) as again:
        assert again["mse"].dims == ("experiment", "run", "model", "n", "chamber")
        xr.testing.assert_identical(again["mse"].drop_attrs().load(), cells["mse"].drop_attrs())
        assert again.attrs["title"] == TITLE and again.attrs["config_sha256"] == short.config_sha256
        assert again["mse"].attrs["units"] == "Pa2"
    check_folder(tmp_path / "out")  # its own files may be replaced
    before = (page.read_bytes(), stored.read_bytes())
    save_study(short, cells, found, tmp_path / "out")
    assert before == (page.read_bytes(), stored.read_bytes())


def test_a_foreign_page_stays(tmp_path):
    (tmp_path / "study.html").touch()
    with pytest.raises(InputError, match=r"study\.html: not written by"):
        check_folder(tmp_path)


def test_a_study_without_an_answer_has_no_figure(short, cells):
    study_of = ModelStudy(short, cells, load(TEMPLATE))  # no cylinders were drawn
    for cylinder, words in ((None, "mine: no model to show"), ("theirs", "must be one of mine")):
        with pytest.raises(InputError, match=words):
            study_of.plot(cylinder)
