# Configuration -> parameters -> settling runs, full-order runs -> replays.


rule parameters:
    output:
        "results/parameters.json",
    log:
        "results/logs/parameters.log",
    params:
        study=STUDY,
        code=code_behind("parameters.py"),
    message:
        "Configuration {config[name]}: converting to SI units"
    script:
        "../scripts/parameters.py"


rule settling:
    input:
        rules.parameters.output,
    output:
        "results/settling/{experiment}.nc",
    log:
        "results/logs/settling/{experiment}.log",
    params:
        code=code_behind("settling.py"),
    message:
        "{wildcards.experiment}: settling-time run"
    script:
        "../scripts/settling.py"


rule datum:
    input:
        rules.parameters.output,
    output:
        "results/datum/{experiment}.nc",
    log:
        "results/logs/datum/{experiment}.log",
    params:
        code=code_behind("datum.py"),
    message:
        "{wildcards.experiment}: full-order run"
    script:
        "../scripts/datum.py"


rule replay:
    input:
        parameters=rules.parameters.output[0],
        datum=rules.datum.output[0],
    output:
        expand("results/{transport}/replay/{{experiment}}.nc", transport=TRANSPORTS),
    log:
        "results/logs/replay/{experiment}.log",
    params:
        code=code_behind("replay.py"),
    message:
        "{wildcards.experiment}: replays of all models, both transports"
    script:
        "../scripts/replay.py"
