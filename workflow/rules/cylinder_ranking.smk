# Cylinders of a user: the grid over seeds for each, and one page for all, as `pneumo study` makes them.


rule ranking_cells:
    input:
        parameters=rules.parameters.output[0],
    output:
        cells="<results>/study/{cylinder}.nc",
    log:
        "<results>/logs/study/{cylinder}.log",
    wildcard_constraints:
        cylinder=r"[A-Za-z][\w-]*",
    params:
        known=lookup("{cylinder}", within=LIMITS),
        code=code_behind("ranking_cells.py"),
    message:
        "Full-order runs and replays over seeds, cylinder {wildcards.cylinder}"
    script:
        "../scripts/ranking_cells.py"


rule ranking_page:
    input:
        parameters=rules.parameters.output[0],
        cells=expand(rules.ranking_cells.output[0], cylinder=USER_CYLINDERS),
        templates=page_templates("study.html.j2"),
    output:
        page="<results>/study.html",
    log:
        "<results>/logs/ranking_page.log",
    params:
        code=code_behind("ranking_page.py"),
    message:
        "Ranking of the models on each cylinder"
    script:
        "../scripts/ranking_page.py"


rule cylinder_ranking:
    input:
        rules.parameters.output,
        rules.datum.output,
        rules.replay.output,
        rules.statistics.output,
        rules.ranking_page.output,
        rules.report.output,
