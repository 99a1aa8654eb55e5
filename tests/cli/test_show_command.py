"""`pneumo show`: what it says of a record whose columns are mistaken."""

import shlex

import numpy as np
import pandas as pd

from pneumo.configuration.parameters import load, study
from pneumo.runs import simulate
from pneumo.selection.plants import configured_plant


def test_show_says_which_columns_look_swapped_and_how_they_were_read(inside, tmp_path):
    inside("init")
    plant = configured_plant(study(load(tmp_path / "cylinder.yaml")))
    run = simulate(plant, 1e-3, command=2.0 * np.sign(np.sin(np.arange(1500) / 90)))
    swapped = {
        "t_s": run.t,
        "u_V": run.u,
        "x_mm": 1e3 * run.x,
        "P_A_bar": run.P_B / 1e5,
        "P_B_bar": run.P_A / 1e5,
    }
    pd.DataFrame(swapped).to_csv(tmp_path / "record.csv", index=False)
    code, out, err = inside("show", "record.csv", "--config", "cylinder.yaml")
    assert code == 0 and "columns P_A and P_B look swapped" in err
    assert out.startswith(f"{len(run.t)} samples, 0.001 s apart, {run.t[-1]:.4g} s\n")
    assert "x: column x_mm, mm, 1000 Hz, linear: " in out and "P_B: column P_B_bar, bar absolute" in out
    _, _, err = inside("show", "record.csv", "--config", "cylinder.yaml", "--trust")
    assert "swapped" not in err


def test_the_option_that_an_error_proposes_can_be_pasted(inside, tmp_path):
    inside("init")
    plant = configured_plant(study(load(tmp_path / "cylinder.yaml")))
    run = simulate(plant, 1e-3, command=2.0 * np.sign(np.sin(np.arange(1500) / 90)))
    columns = {"Zeit [s]": run.t, "rCmd": run.u, "rPos": 1e3 * run.x, "rPresA": run.P_A / 1e5}
    pd.DataFrame({**columns, "rPresB": run.P_B / 1e5}).to_csv(tmp_path / "record.csv", index=False)
    code, _, err = inside("show", "record.csv", "--config", "cylinder.yaml")
    assert code == 2
    option = shlex.split(err[err.index("--columns '") :])
    code, out, _ = inside("show", "record.csv", "--config", "cylinder.yaml", *option)
    assert code == 0 and "P_B: column rPresB, bar absolute, 1000 Hz" in out
