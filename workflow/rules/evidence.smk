# A measured gas spring, and the manuscript: `snakemake -j2 evidence`. Not part of the study.

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


rule measurements_figure:
    input:
        cells=lambda _: kept_or_made(RESULTS, STUDY, "measurements.nc"),
    output:
        figure=expand("<results>/figures/measurements.{kind}", kind=["svg", "png"]),
    log:
        "<results>/logs/figure_measurements.log",
    params:
        code=sha256_of("workflow/scripts/measurements_figure.py"),
    message:
        "Figure of measured records of closed chambers"
    script:
        "../scripts/measurements_figure.py"


rule measurements:
    input:
        rules.measured_records.output,
        rules.measurements_figure.output,


rule evidence:
    input:
        rules.measurements.input,
        "<results>/paper.pdf",  # of rules/manuscript.smk
