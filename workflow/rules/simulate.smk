# Configuration -> settling runs and times, full-order runs -> replays.


rule settling:
    output:
        runs=expand("<results>/settling/{experiment}.nc", experiment=STUDY.experiments),
        table="<results>/settling.nc",
    log:
        "<results>/logs/settling.log",
    priority: 1  # before what replays do not wait for
    params:
        study=STUDY,
        code=sha256_of("workflow/scripts/settling.py"),
    message:
        "Settling-time runs, settling times and the ten-times rule"
    script:
        "../scripts/settling.py"


rule datum:
    output:
        parameters="<results>/parameters.json",
        runs=expand("<results>/datum/{experiment}.nc", experiment=STUDY.experiments),
    log:
        "<results>/logs/datum.log",
    priority: 2  # the replays wait for it
    threads: all_cores_but_one  # which the settling runs have meanwhile
    params:
        study=STUDY,
        code=sha256_of("workflow/scripts/datum.py"),
    message:
        "Configuration {config[name]} in SI units, full-order runs"
    script:
        "../scripts/datum.py"


rule replay:
    input:
        parameters=rules.datum.output.parameters,
        datum=rules.datum.output.runs,
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
        code=sha256_of("workflow/scripts/replay.py"),
    message:
        "Replays of all models, both signal samplings: errors, also by interval of time for the report"
    script:
        "../scripts/replay.py"
