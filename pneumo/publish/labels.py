"""Labels of what results store under short names; needs no plotting library."""

# How samples of a full-order run's signals reach the replays -> label.
SAMPLING = {
    "published": "sampled as in the paper",
    "exact": "exact signals",
    "linear": "interpolated",
    "hold": "held",
    "delay": "held, one sample late",
    "linear, 0.13 ms late": "interpolated, 0.13 ms late",
    "linear, u a sample late": "interpolated, u a sample late",
    "hold, end of step next": "held, end of step next",
}
STUDY_SAMPLING = {name: SAMPLING[name] for name in ("published", "exact")}

# Averages over experiments, and kinds of experiments.
AVERAGES = {"mean": "mean", "geometric": "geom. mean"}
