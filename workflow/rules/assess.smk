# Replays and settling runs -> statistics over experiments.


rule statistics:
    input:
        parameters=rules.parameters.output[0],
        cells=expand("results/{{transport}}/replay/{experiment}.nc", experiment=STUDY.experiments),
    output:
        "results/{transport}/statistics.nc",
    log:
        "results/logs/statistics-{transport}.log",
    params:
        code=code_behind("statistics.py"),
    message:
        "Statistics over experiments, {wildcards.transport} transport"
    script:
        "../scripts/statistics.py"


rule settling_table:
    input:
        parameters=rules.parameters.output[0],
        runs=expand(rules.settling.output, experiment=STUDY.experiments),
    output:
        "results/settling.nc",
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
        parameters=rules.parameters.output[0],
        settling_table=rules.settling_table.output[0],
        settling=expand(rules.settling.output, experiment=STUDY.experiments),
        datum=expand(rules.datum.output, experiment=STUDY.experiments),
        cells=expand(
            "results/{transport}/replay/{experiment}.nc", transport=TRANSPORTS, experiment=STUDY.experiments
        ),
        statistics=expand(rules.statistics.output, transport=TRANSPORTS),
        claims="paper/claims.yaml",
        errata="paper/errata.yaml",
        assumptions="paper/assumptions.yaml",
        published=expand("paper/published/table{number}.csv", number=range(1, 10)),
    output:
        "results/verdict.json",
    log:
        "results/logs/verdict.log",
    params:
        code=code_behind("verdict.py"),
    message:
        "Verdict: every published number and claim"
    script:
        "../scripts/verdict.py"
