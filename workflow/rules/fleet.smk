# A table of cylinders: blocks of them, one job each, then one index. Nothing else is planned.


def block_content(wildcards):
    """Configuration of a block's cylinders: an edit of a row reruns its block only."""
    return FLEET.content(wildcards.block)


rule fleet_block:
    output:
        cells="<results>/fleet/{block}.nc",
    log:
        "<results>/logs/fleet/{block}.log",
    wildcard_constraints:
        block=r"\d+",
    threads: all_cores
    resources:
        runtime=lambda wildcards, threads, attempt: FLEET.resources(wildcards.block).runtime(threads, attempt),
        mem_mb=lambda wildcards, threads, attempt: FLEET.resources(wildcards.block).mem_mb(threads, attempt),
    params:
        content=block_content,
        signals=sha256_of(*FLEET.signal_files()),
        code=sha256_of("workflow/scripts/fleet_block.py", "workflow/jobs/fleet.py"),
    message:
        "Cylinders from {wildcards.block} on: full-order runs and replays over seeds, rankings"
    script:
        "../scripts/fleet_block.py"


rule fleet_index:
    input:
        blocks=expand("<results>/fleet/{block}.nc", block=FLEET.blocks),
    output:
        index="<results>/fleet.nc",
        page="<results>/fleet.html",
    log:
        "<results>/logs/fleet_index.log",
    params:
        name=FLEET.sources.content["name"],
        code=sha256_of(
            "workflow/scripts/fleet_index.py",
            "workflow/jobs/fleet.py",
            "workflow/jobs/fleet_page.py",
        ),
    message:
        "Index of all cylinders"
    script:
        "../scripts/fleet_index.py"


rule fleet:
    input:
        rules.fleet_index.output,
