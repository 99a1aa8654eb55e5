# Results -> figures and the tables that the README shows.


rule schemes:
    output:
        expand(
            "results/figures/fig{number}.{kind}",
            number=["01", "02", "03", "04", "05", "06", "12"],
            kind=["svg", "png"],
        ),
    log:
        "results/logs/schemes.log",
    conda:
        "pneumo"
    params:
        code=code_behind("schemes.py"),
    message:
        "Figures 1-6 and 12: schemes"
    script:
        "../scripts/schemes.py"


rule figures:
    input:
        parameters=rules.parameters.output,
        settling=expand(rules.settling.output, experiment=STUDY.experiments),
        datum=expand(rules.datum.output, experiment=STUDY.experiments),
        cells=expand(
            "results/{transport}/replay/{experiment}.nc", transport=TRANSPORTS, experiment=STUDY.experiments
        ),
        statistics=expand(rules.statistics.output, transport=TRANSPORTS),
    output:
        expand(
            "results/figures/{name}.{kind}",
            name=["fig07", "fig08", "fig09", "fig10", "fig11", "traces", "mse_over_n"],
            kind=["svg", "png"],
        ),
    log:
        "results/logs/figures.log",
    conda:
        "pneumo"
    params:
        code=code_behind("figures.py"),
    message:
        "Figures 7-11, time traces, error over n"
    script:
        "../scripts/figures.py"


rule tables:
    input:
        expand(rules.statistics.output, transport="published"),
    output:
        "results/table7.md",
    log:
        "results/logs/tables.log",
    conda:
        "pneumo"
    params:
        code=code_behind("tables.py"),
    message:
        "Table 7, reproduced beside published"
    script:
        "../scripts/tables.py"
