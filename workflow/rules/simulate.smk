# Configuration -> parameters -> settling runs and times, full-order runs -> replays.


rule parameters:
    output:
        parameters="<results>/parameters.json",
    log:
        "<results>/logs/parameters.log",
    priority: 3
    threads: all_cores  # nothing starts beside it that would keep a core from the full-order runs
    params:
        study=STUDY,
        code=code_behind("parameters.py"),
    message:
        "Configuration {config[name]}: converting to SI units"
    script:
        "../scripts/parameters.py"


rule settling:
    input:
        parameters=rules.parameters.output[0],
    output:
        runs=expand("<results>/settling/{experiment}.nc", experiment=STUDY.experiments),
        table="<results>/settling.nc",
    log:
        "<results>/logs/settling.log",
    priority: 1  # before what replays do not wait for
    params:
        code=code_behind("settling.py"),
    message:
        "Settling-time runs, settling times and the ten-times rule"
    script:
        "../scripts/settling.py"


rule datum:
    input:
        parameters=rules.parameters.output[0],
    output:
        runs=expand("<results>/datum/{experiment}.nc", experiment=STUDY.experiments),
    log:
        "<results>/logs/datum.log",
    priority: 2  # the replays wait for it
    threads: all_cores_but_one  # which the settling runs have meanwhile
    params:
        code=code_behind("datum.py"),
    message:
        "Full-order runs"
    script:
        "../scripts/datum.py"


rule replay:
    input:
        parameters=rules.parameters.output[0],
        datum=rules.datum.output,
    output:
        cells=expand(
            "<results>/{transport}/replay/{experiment}.nc",
            transport=TRANSPORTS,
            experiment=STUDY.experiments,
        ),
        traces=expand(
            "<results>/{transport}/traces/{experiment}.nc",
            transport=TRANSPORTS,
            experiment=STUDY.experiments,
        ),
    log:
        "<results>/logs/replay.log",
    threads: all_cores
    params:
        code=code_behind("replay.py"),
    message:
        "Replays of all models, both signal samplings: errors, also by interval of time for the report"
    script:
        "../scripts/replay.py"
