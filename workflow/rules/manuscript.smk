# Everything that there is -> the manuscript: `snakemake -j2 results/paper.pdf`, part of `snakemake -j2 evidence`.

READ = ["identification.nc", "error_budget.nc", "floor.nc", "variants.nc", "cylinders.nc", "findings.json"]
READ += ["contest.nc", "measured_air.nc", "partly_known.nc"]


rule manuscript:
    input:
        results=[
            rules.parameters.output[0],
            rules.verdict.output[0],
            rules.ensemble_statistics.output[0],
        ],
        evidence=lambda wildcards: [kept_or_made(RESULTS, STUDY, name) for name in READ],
        figures=expand("<results>/figures/{name}.svg", name=["traces", "floor", "ensemble", "regimes"]),
        sources=[
            "paper/manuscript/style.typ",
            "paper/manuscript/references.bib",
            "paper/manuscript/metadata.yaml",
        ],
        source="paper/manuscript/manuscript.typ",
    output:
        numbers="<results>/manuscript.json",
        pdf="<results>/paper.pdf",
    log:
        "<results>/logs/manuscript.log",
    params:
        code_now=code_now(*[name for name in READ if name in EVIDENCE_CODE]),
        code=code_behind("manuscript.py"),
    message:
        "Manuscript as PDF"
    script:
        "../scripts/manuscript.py"
