# Cylinders of a user: the grid over seeds for each, and one page for all, as `pneumo study` makes them.


rule ranking_cells:
    output:
        cells="<results>/study/{cylinder}.nc",
    log:
        "<results>/logs/study/{cylinder}.log",
    wildcard_constraints:
        cylinder=r"[A-Za-z][\w-]*",
    params:
        study=STUDY,
        known=lookup("{cylinder}", within=LIMITS),
        code=sha256_of("workflow/scripts/ranking_cells.py"),
    message:
        "Full-order runs and replays over seeds, cylinder {wildcards.cylinder}"
    script:
        "../scripts/ranking_cells.py"


rule ranking_page:
    input:
        parameters=rules.datum.output.parameters,
        cells=expand(rules.ranking_cells.output[0], cylinder=USER_CYLINDERS),
    output:
        page="<results>/study.html",
    log:
        "<results>/logs/ranking_page.log",
    params:
        code=sha256_of("workflow/scripts/ranking_page.py"),
    message:
        "Ranking of the models on each cylinder"
    script:
        "../scripts/ranking_page.py"


rule cylinder_ranking:
    input:
        rules.datum.output,
        rules.replay.output,
        rules.statistics.output,
        rules.ranking_page.output,
        rules.report.output,
