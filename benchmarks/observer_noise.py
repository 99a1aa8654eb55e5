"""Tuned noise of exported observers: ``python -m benchmarks.observer_noise``.

It writes pneumo/export/templates/observer_noise.json from paper/evidence/at_work.nc: the process noise of the
pressures that was best in closed loop, geometric mean over the plants, by sensors and model; and the
deviations of the readings with which it was tuned.
"""

import json
from typing import Any

import numpy as np
import xarray as xr

from pneumo.evidence.at_work.plant_at_work import FORCE_NOISE
from pneumo.evidence.at_work.sampled_plant import PRESSURE_VARIANCE, X_VARIANCE
from pneumo.export.observer_noise import FILE
from pneumo.storage.kept_evidence import KEPT


def tuned(at_work: xr.Dataset) -> dict[str, Any]:
    """Content of the file: numbers of two digits."""
    right = at_work["k_0_factor"].values == 1
    noise = at_work["pressure_noise"].sel(loop="closed").isel(carried=right)
    logarithm: xr.DataArray = xr.apply_ufunc(np.log, noise.astype(float))
    mean: xr.DataArray = xr.apply_ufunc(np.exp, logarithm.mean("plant"))
    models = at_work["model"].values[right].tolist()
    return {
        "loop": "closed",
        "plants": at_work.sizes["plant"],
        "force_noise_over_P_s_A_A": FORCE_NOISE,
        "x_deviation": _short(X_VARIANCE**0.5),
        "pressure_deviation": _short(PRESSURE_VARIANCE**0.5),
        "pressure_noise": {
            str(sensors): {
                model: _short(value)
                for model, value in zip(models, mean.sel(sensors=sensors).values.tolist(), strict=True)
            }
            for sensors in at_work["sensors"].values
        },
    }


def _short(value: float) -> float:
    return float(f"{value:.1e}")


if __name__ == "__main__":
    text = json.dumps(tuned(xr.load_dataset(KEPT / "at_work.nc")), indent=1)
    FILE.write_text(text + "\n", encoding="utf-8")
