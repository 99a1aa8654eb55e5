# Replays and settling runs -> statistics over experiments.


rule statistics:
    input:
        parameters=rules.parameters.output[0],
        cells=rules.replay.output,
    output:
        tables=expand("results/{transport}/statistics.nc", transport=TRANSPORTS),
    log:
        "results/logs/statistics.log",
    params:
        code=code_behind("statistics.py"),
    message:
        "Statistics over experiments, both transports"
    script:
        "../scripts/statistics.py"


rule settling_table:
    input:
        parameters=rules.parameters.output[0],
        runs=rules.settling.output,
    output:
        table="results/settling.nc",
    log:
        "results/logs/settling_table.log",
    params:
        code=code_behind("settling_table.py"),
    message:
        "Settling times and the ten-times rule"
    script:
        "../scripts/settling_table.py"


rule verdict:
    input:
        # Evidence is not part of the study; once it is there, the verdict uses it and it is kept up to date.
        evidence=evidence_for(STUDY, "assumptions.nc") + evidence_for(STUDY, "power.nc"),
        parameters=rules.parameters.output[0],
        settling_table=rules.settling_table.output[0],
        settling=rules.settling.output,
        datum=rules.datum.output,
        cells=rules.replay.output,
        statistics=rules.statistics.output,
        claims="paper/2006/claims.yaml",
        errata="paper/2006/errata.yaml",
        assumptions="paper/2006/assumptions.yaml",
        seed_deviations="paper/2006/seed_deviations.csv",
        published=expand("paper/2006/published/table{number}.csv", number=range(1, 10)),
        figures=expand("paper/2006/published/figure{number}.csv", number=[7, 9, 11]),
    output:
        judged="results/verdict.json",
    log:
        "results/logs/verdict.log",
    params:
        name="2006",
        code=code_behind("verdict.py", "pneumo.papers.paper_2006.paper"),
    message:
        "Verdict: every published number and claim"
    script:
        "../scripts/verdict.py"
