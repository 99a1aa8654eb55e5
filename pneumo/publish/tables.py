"""Tables as Markdown, reproduced values beside published ones."""

import xarray as xr


def table_7(statistics: xr.Dataset, published: xr.Dataset) -> str:
    """Average MSE, mean and standard deviation of the error of every model at its best n.

    Parameters
    ----------
    statistics : xarray.Dataset
        From `pneumo.assess.statistics.statistics`, published transport.
    published : xarray.Dataset
        From `pneumo.assess.published.table7`.
    """
    ours = statistics.sel(level="overall")
    lines = [
        "| model | MSE, published (Pa²) | MSE, reproduced (Pa²) | ratio | μ, published (Pa)"
        " | μ, reproduced (Pa) | σ, published (Pa) | σ, reproduced (Pa) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for model in published["model"].values:
        a, b = published.sel(model=model), ours.sel(model=model)
        lines.append(
            f"| {model} | {a['mse'].item():.2e} | {b['mse'].item():.2e} | {(b['mse'] / a['mse']).item():.2f}"
            f" | {a['mean_error'].item():.0f} | {b['mean_error'].item():.0f}"
            f" | {a['std'].item():.0f} | {b['std'].item():.0f} |"
        )
    failure_time = statistics["failure_time"].dropna("experiment")
    lines += [
        f"\n{name} is left out: its full-order run failed at t = {time:g} s."
        for name, time in zip(failure_time["experiment"].values, failure_time.values, strict=True)
    ]
    return "\n".join(lines) + "\n"
