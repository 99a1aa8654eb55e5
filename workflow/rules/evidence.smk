# What the study rests on; not part of it: `snakemake -j2 evidence`, then `snakemake -j2` for the verdict.


# Figures that one function draws from one file of evidence: where they are from, and how they are drawn.
DRAWN = {
    figure: {
        "results": f"{results}.nc",
        "draw": f"pneumo.publish.figures.{module}.{function}",
        "code": code_behind("figure.py", f"pneumo.publish.figures.{module}"),
    }
    for figure, results, module, function in [
        ("floor", "floor", "floor_figure", "floor_figure"),
        ("ensemble", "ensemble", "ensemble_figure", "ensemble_figure"),
        ("regimes", "cylinders", "regimes_figure", "regime_map"),
        ("variants", "variants", "alternatives_figures", "variants_figure"),
        ("measurements", "measurements", "measurements_figure", "measurements_figure"),
        ("pulses", "measured_air", "measured_air_figure", "pulses_figure"),
        ("vessel", "measured_air", "measured_air_figure", "vessel_figure"),
    ]
}

# The code that makes each file of evidence of which pages say how it was made.
EVIDENCE_CODE = {
    f"{name}.nc": code_behind(f"{name}.py")
    for name in [
        "assumptions",
        "power",
        "variants",
        "cylinders",
        "contest",
        "measured_air",
    ]
} | {
    "findings.json": code_behind("findings.py"),
}


rule evidence_figure:
    input:
        results=lambda wildcards: kept_or_made(RESULTS, STUDY, DRAWN[wildcards.drawn]["results"]),
    output:
        figure=expand("<results>/figures/{{drawn}}.{kind}", kind=["svg", "png"]),
    log:
        "<results>/logs/figure_{drawn}.log",
    wildcard_constraints:
        drawn="|".join(DRAWN),
    params:
        draw=lookup("{drawn}/draw", within=DRAWN),
        code=lambda wildcards: DRAWN[wildcards.drawn]["code"](wildcards),
    message:
        "Figure {wildcards.drawn}"
    script:
        "../scripts/figure.py"


rule assumptions:
    input:
        claims="paper/2006/claims.yaml",
        assumptions="paper/2006/assumptions.yaml",
        published=expand("paper/2006/published/table{number}.csv", number=range(1, 10)),
    output:
        toggled="<results>/assumptions.nc",
    log:
        "<results>/logs/assumptions.log",
    threads: all_cores
    params:
        configuration=config,
        code=code_behind("assumptions.py"),
    message:
        "Every assumption toggled: Tables 5, 7, 8 and 9 anew"
    script:
        "../scripts/assumptions.py"


rule assumptions_effects:
    input:
        toggled=kept("assumptions.nc"),
        claims="paper/2006/claims.yaml",
    output:
        table="<results>/assumptions.md",
        figure=expand("<results>/figures/assumptions.{kind}", kind=["svg", "png"]),
    log:
        "<results>/logs/assumptions_effects.log",
    params:
        code=code_behind("assumptions_effects.py"),
    message:
        "Effects of the assumptions: table and tornado plot"
    script:
        "../scripts/assumptions_effects.py"


rule power:
    input:
        parameters=rules.parameters.output[0],
        cells=expand("<results>/published/replay/{experiment}.nc", experiment=STUDY.experiments),
        runs=[rules.datum.output, rules.settling.output.runs],
        claims="paper/2006/claims.yaml",
        seed_deviations="paper/2006/seed_deviations.csv",
    output:
        agrees="<results>/power.nc",
    log:
        "<results>/logs/power.log",
    threads: all_cores
    params:
        configuration=config,
        code=code_behind("power.py"),
    message:
        "Power of the verdict: the study under known mistakes"
    script:
        "../scripts/power.py"


RECORDS = ["2021-07-26", "2022-01-28", "2022-12-21-vented", "friction"]  # of data/mbari


rule measured_records:
    input:
        records=[f"data/mbari/{name}.nc" for name in RECORDS],
    output:
        cells="<results>/measurements.nc",
    log:
        "<results>/logs/measurements.log",
    params:
        code=code_behind("measurements.py"),
    message:
        "Thermal laws on measured records of closed chambers"
    script:
        "../scripts/measurements.py"


rule measured_air:
    input:
        records=[
            "data/valve_driven/pulses.nc",
            "data/valve_driven/rig.yaml",
            *[
                f"data/tank/{run}.{kind}"
                for run in ["discharge", "filling", "nitrogen"]
                for kind in ["nc", "yaml"]
            ],
            *[f"data/mbari/{name}.nc" for name in RECORDS],
        ],
    output:
        cells="<results>/measured_air.nc",
    log:
        "<results>/logs/measured_air.log",
    params:
        code=code_behind("measured_air.py"),
    message:
        "Models on measured air and nitrogen with flow"
    script:
        "../scripts/measured_air.py"


rule measurements:
    input:
        rules.measured_records.output,
        rules.measured_air.output,
        expand(
            "<results>/figures/{drawn}.{kind}",
            drawn=["measurements", "pulses", "vessel"],
            kind=["svg", "png"],
        ),


rule variants:
    input:
        assumptions="paper/2006/assumptions.yaml",
    output:
        cells="<results>/variants.nc",
    log:
        "<results>/logs/variants.log",
    threads: all_cores
    params:
        configuration=config,
        code=code_behind("variants.py"),
    message:
        "Refinements of the models under other assumptions and other physics"
    script:
        "../scripts/variants.py"


rule variants_summary:
    input:
        cells=kept("variants.nc"),
    output:
        table="<results>/variants.md",
    log:
        "<results>/logs/variants_summary.log",
    params:
        code=code_behind("variants_summary.py"),
    message:
        "Refinements under other assumptions: table"
    script:
        "../scripts/variants_summary.py"


rule evidence:
    input:
        rules.assumptions_effects.output,
        rules.variants_summary.output,
        kept("power.nc"),
        expand("<results>/figures/{name}.{kind}", name=DRAWN, kind=["svg", "png"]),
        rules.ensemble.input,
        "<results>/paper.pdf",  # of rules/manuscript.smk, which reads the rest
