# What the study rests on, apart from the study itself: `snakemake -j2 evidence`.


rule error_budget:
    input:
        rules.parameters.output,
    output:
        "results/error_budget.nc",
    log:
        "results/logs/error_budget.log",
    threads: workflow.cores
    params:
        code=code_behind("error_budget.py"),
    message:
        "Error budget: model, signal transport and step"
    script:
        "../scripts/error_budget.py"


rule error_budget_figure:
    input:
        rules.error_budget.output,
    output:
        expand("results/figures/error_budget.{kind}", kind=["svg", "png"]),
    log:
        "results/logs/error_budget_figure.log",
    params:
        code=code_behind("error_budget_figure.py"),
    message:
        "Figure of the error budget"
    script:
        "../scripts/error_budget_figure.py"


rule evidence:
    input:
        rules.error_budget_figure.output,
