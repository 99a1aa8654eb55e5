# Cylinders of one's own: the grid over seeds for each, and one page for all; what `pneumo study` makes.


rule own_cells:
    input:
        parameters=rules.parameters.output[0],
    output:
        cells="results/study/{cylinder}.nc",
    log:
        "results/logs/study/{cylinder}.log",
    wildcard_constraints:
        cylinder=r"[A-Za-z][\w-]*",
    params:
        k_0_factor=lookup("{cylinder}", within=K_0_FACTORS),
        code=code_behind("own_cells.py"),
    message:
        "Full-order runs and replays over seeds, cylinder {wildcards.cylinder}"
    script:
        "../scripts/own_cells.py"


rule own_page:
    input:
        parameters=rules.parameters.output[0],
        cells=expand(rules.own_cells.output[0], cylinder=OWN_CYLINDERS),
        templates=[
            "pneumo/publish/pages/templates/page.html.j2",
            "pneumo/publish/pages/templates/macros.html.j2",
            "pneumo/publish/pages/templates/study.html.j2",
            "pneumo/publish/pages/templates/page.css",
            "pneumo/publish/pages/templates/engineer.css",
        ],
    output:
        page="results/study.html",
    log:
        "results/logs/own_page.log",
    params:
        code=code_behind("own_page.py"),
    message:
        "Ranking of the models on each cylinder"
    script:
        "../scripts/own_page.py"


rule own:
    input:
        rules.parameters.output,
        rules.datum.output,
        rules.replay.output,
        rules.statistics.output,
        rules.own_page.output,
        rules.report.output,
