# Replays -> statistics over experiments; everything -> verdict.


rule statistics:
    input:
        parameters=rules.datum.output.parameters,
        cells=rules.replay.output.cells,
    output:
        tables=expand("<results>/{transport}/statistics.nc", transport=TRANSPORTS),
    log:
        "<results>/logs/statistics.log",
    params:
        code=sha256_of("workflow/scripts/statistics.py"),
    message:
        "Statistics over experiments, for both samplings of the signals"
    script:
        "../scripts/statistics.py"


rule verdict:
    input:
        # Of a finished study, if it was made from this configuration: docs/reproduce.md.
        evidence=evidence_for(RESULTS, STUDY, "seed_sets.nc"),
        parameters=rules.datum.output.parameters,
        settling=rules.settling.output,
        datum=rules.datum.output.runs,
        cells=rules.replay.output.cells,
        statistics=rules.statistics.output,
        claims="paper/2006/claims.yaml",
        facts="paper/2006/facts.yaml",
        errata="paper/2006/errata.yaml",
        assumptions="paper/2006/assumptions.yaml",
        seed_deviations="paper/2006/seed_deviations.csv",
        published=expand("paper/2006/published/table{number}.csv", number=range(1, 10)),
        figures=expand("paper/2006/published/figure{name}.csv", name=["7", "7_traces", "9", "10", "11"]),
        about=expand("paper/2006/{file}", file=["paper.yaml", "findings.html.j2", "simulators.json"]),
    output:
        judged="<results>/verdict.json",
        page=report("<results>/verdict.html", caption="../captions/verdict.rst", category="Pages"),
    log:
        "<results>/logs/verdict.log",
    params:
        name="2006",
        code=sha256_of("workflow/scripts/verdict.py", "paper/study/paper_2006/paper.py"),
    message:
        "Verdict: every published number and claim, and its page"
    script:
        "../scripts/verdict.py"
