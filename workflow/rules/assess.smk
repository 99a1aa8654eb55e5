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
