# Results -> figures and pages.

SCHEMES = ["01", "02", "03", "04", "05", "06", "12"]
FIGURES = ["fig07", "fig08", "fig09", "fig10", "fig11", "traces"]


rule schemes:
    input:
        schemes=expand("paper/schemes/fig{number}.svg", number=SCHEMES),
    output:
        figures=report(
            expand("<results>/figures/fig{number}.svg", number=SCHEMES),
            caption="../captions/schemes.rst",
            category="Figures",
            subcategory="Schemes",
        ),
    log:
        "<results>/logs/schemes.log",
    message:
        "Figures 1-6 and 12: schemes, kept by hand"
    script:
        "../scripts/schemes.py"


rule figures:
    input:
        parameters=rules.datum.output.parameters,
        settling=f"<results>/settling/{shown('fig07', STUDY.experiments)}.nc",
        datum=f"<results>/datum/{shown('traces', STUDY.experiments)}.nc",
        cells=rules.replay.output.cells,
        statistics=rules.statistics.output,
        published=expand(
            "paper/2006/published/{name}.csv",
            name=["table7", "table9", "figure7_traces", "figure9", "figure10", "figure11"],
        ),
    output:
        svg=report(
            expand("<results>/figures/{name}.svg", name=FIGURES),
            caption="../captions/figures.rst",
            category="Figures",
            subcategory="Results",
        ),
        png=expand("<results>/figures/{name}.png", name=FIGURES),
    log:
        "<results>/logs/figures.log",
    params:
        code=sha256_of("workflow/scripts/figures.py"),
    message:
        "Figures 7-11 and time traces"
    script:
        "../scripts/figures.py"


rule report:
    input:
        parameters=rules.datum.output.parameters,
        datum=rules.datum.output.runs,
        replays=rules.replay.output,  # with traces
        verdict=[] if USER_CYLINDERS else [rules.verdict.output.judged],
        findings=[] if USER_CYLINDERS else evidence_for(RESULTS, STUDY, "findings.json"),
    output:
        page=report("<results>/report.html", caption="../captions/report.rst", category="Pages"),
    log:
        "<results>/logs/report.log",
    params:
        manuscript=exists(f"{RESULTS}/paper.pdf"),
        code=sha256_of("workflow/scripts/report.py"),
    message:
        "Report: the study as a page to explore"
    script:
        "../scripts/report.py"
