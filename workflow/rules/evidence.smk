# Models on measured air, and the manuscript: `snakemake -j2 evidence`. Not part of the study.


# Figures that one function draws from one file of evidence: where they are from, and how they are drawn.
DRAWN = {
    figure: {
        "results": f"{results}.nc",
        "draw": f"paper.study.figures.{module}.{function}",
    }
    for figure, results, module, function in [
        ("measurements", "measurements", "measurements_figure", "measurements_figure"),
        ("pulses", "measured_air", "measured_air_figure", "pulses_figure"),
        ("vessel", "measured_air", "measured_air_figure", "vessel_figure"),
    ]
}


rule evidence_figure:
    input:
        results=lambda wildcards: kept_or_made(RESULTS, STUDY, DRAWN[wildcards.drawn]["results"]),
    output:
        figure=expand("<results>/figures/{{drawn}}.{kind}", kind=["svg", "png"]),
    log:
        "<results>/logs/figure_{drawn}.log",
    wildcard_constraints:
        drawn="|".join(DRAWN),
    params:
        draw=lookup("{drawn}/draw", within=DRAWN),
        code=sha256_of(
            "workflow/scripts/figure.py",
            "paper/study/figures/measurements_figure.py",
            "paper/study/figures/measured_air_figure.py",
        ),
    message:
        "Figure {wildcards.drawn}"
    script:
        "../scripts/figure.py"


RECORDS = ["2021-07-26", "2022-01-28", "2022-12-21-vented", "friction"]  # of data/mbari


rule measured_records:
    input:
        records=[f"data/mbari/{name}.nc" for name in RECORDS],
    output:
        cells="<results>/measurements.nc",
    log:
        "<results>/logs/measurements.log",
    params:
        code=sha256_of("workflow/scripts/measurements.py"),
    message:
        "Thermal laws on measured records of closed chambers"
    script:
        "../scripts/measurements.py"


rule measured_air:
    input:
        records=[
            "data/valve_driven/pulses.nc",
            "data/valve_driven/rig.yaml",
            *[
                f"data/tank/{run}.{kind}"
                for run in ["discharge", "filling", "nitrogen"]
                for kind in ["nc", "yaml"]
            ],
            *[f"data/mbari/{name}.nc" for name in RECORDS],
        ],
    output:
        cells="<results>/measured_air.nc",
    log:
        "<results>/logs/measured_air.log",
    params:
        code=sha256_of("workflow/scripts/measured_air.py"),
    message:
        "Models on measured air and nitrogen with flow"
    script:
        "../scripts/measured_air.py"


rule measurements:
    input:
        rules.measured_records.output,
        rules.measured_air.output,
        expand(
            "<results>/figures/{drawn}.{kind}",
            drawn=["measurements", "pulses", "vessel"],
            kind=["svg", "png"],
        ),


rule evidence:
    input:
        rules.measurements.input,
        "<results>/paper.pdf",  # of rules/manuscript.smk
