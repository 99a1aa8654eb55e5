# Results -> figures and the tables that the README shows.

# The one experiment that a figure shows: the paper's example; and one in which transport alone decides
# whether mixing pays. A smaller study shows its first.
SHOWN = {
    figure: experiment if experiment in STUDY.experiments else next(iter(STUDY.experiments))
    for figure, experiment in {"fig07": "E14", "traces": "E06"}.items()
}


rule schemes:
    output:
        expand(
            "results/figures/fig{number}.{kind}",
            number=["01", "02", "03", "04", "05", "06", "12"],
            kind=["svg", "png"],
        ),
    log:
        "results/logs/schemes.log",
    params:
        code=code_behind("schemes.py"),
    message:
        "Figures 1-6 and 12: schemes"
    script:
        "../scripts/schemes.py"


rule figures:
    input:
        parameters=rules.parameters.output[0],
        settling=f"results/settling/{SHOWN['fig07']}.nc",
        datum=f"results/datum/{SHOWN['traces']}.nc",
        cells=rules.replay.output,
        statistics=rules.statistics.output,
    output:
        expand(
            "results/figures/{name}.{kind}",
            name=["fig07", "fig08", "fig09", "fig10", "fig11", "traces", "mse_over_n"],
            kind=["svg", "png"],
        ),
    log:
        "results/logs/figures.log",
    params:
        code=code_behind("figures.py"),
    message:
        "Figures 7-11, time traces, error over n"
    script:
        "../scripts/figures.py"


rule tables:
    input:
        "results/published/statistics.nc",
    output:
        "results/table7.md",
    log:
        "results/logs/tables.log",
    params:
        code=code_behind("tables.py"),
    message:
        "Table 7, reproduced beside published"
    script:
        "../scripts/tables.py"


rule verdict_page:
    input:
        verdict=rules.verdict.output[0],
        templates=expand("pneumo/publish/templates/verdict.{kind}", kind=["html.j2", "css", "js"]),
    output:
        "results/verdict.html",
    log:
        "results/logs/verdict_page.log",
    params:
        code=code_behind("verdict_page.py"),
    message:
        "Verdict as a page"
    script:
        "../scripts/verdict_page.py"
