# Study and finished studies -> the manuscript: `snakemake -j2 results/paper.pdf`, part of `snakemake -j2 evidence`.


rule manuscript:
    input:
        parameters=rules.datum.output.parameters,
        verdict=rules.verdict.output[0],
        frozen="paper/manuscript/frozen.json",
        figures=[
            "<results>/figures/traces.svg",
            *expand("paper/manuscript/figures/{name}.svg", name=["floor", "ensemble", "regimes"]),
        ],
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
        code=sha256_of("workflow/scripts/manuscript.py"),
    message:
        "Manuscript as PDF"
    script:
        "../scripts/manuscript.py"
