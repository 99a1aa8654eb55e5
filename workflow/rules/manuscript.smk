# Everything that there is -> the manuscript: `snakemake -j2 results/paper.pdf`, part of `snakemake -j2 evidence`.


rule manuscript:
    input:
        results=[
            rules.parameters.output[0],
            rules.verdict.output[0],
            rules.findings.output.findings,
            rules.ensemble_statistics.output[0],
            rules.identification.output[0],
            rules.error_budget.output[0],
            rules.floor.output[0],
            rules.variants.output[0],
            rules.cylinders_analysis.output.cells,
        ],
        figures=expand("results/figures/{name}.svg", name=["traces", "floor", "ensemble", "regimes"]),
        sources=[
            "paper/manuscript/style.typ",
            "paper/manuscript/references.bib",
            "paper/manuscript/metadata.yaml",
        ],
        source="paper/manuscript/manuscript.typ",
    output:
        numbers="results/manuscript.json",
        pdf="results/paper.pdf",
    log:
        "results/logs/manuscript.log",
    params:
        code=code_behind("manuscript.py"),
    message:
        "Manuscript as PDF"
    script:
        "../scripts/manuscript.py"
