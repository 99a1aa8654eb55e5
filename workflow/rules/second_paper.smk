# The paper of 2007: its simulated example, verdict, page and figures. It needs no result of the study.

# Figures, where they are from and how they are drawn.
DRAWN_2007 = {
    figure: {
        "results": f"results/2007/{results}.nc",
        "draw": f"pneumo.publish.figures.conductance_figures.{figure}",
    }
    for figure, results in [("simulated_example", "example"), ("coefficients", "coefficients")]
}


rule simulated_example:
    input:
        claims="paper/2007/claims.yaml",
        published=expand(
            "paper/2007/published/{name}.csv", name=["table2", "table3", "table4", "table5", "quoted"]
        ),
    output:
        response="results/2007/example.nc",
        coefficients="results/2007/coefficients.nc",
    log:
        "results/logs/simulated_example.log",
    params:
        code=code_behind("simulated_example.py"),
    message:
        "Simulated example of 2007, and coefficients of its cylinders"
    script:
        "../scripts/simulated_example.py"


rule verdict_2007:
    input:
        example=rules.simulated_example.output.response,
        claims="paper/2007/claims.yaml",
        errata="paper/2007/errata.yaml",
        assumptions="paper/2007/assumptions.yaml",
        published=expand("paper/2007/published/table{number}.csv", number=range(1, 6)),
    output:
        judged="results/2007/verdict.json",
    log:
        "results/logs/verdict_2007.log",
    params:
        name="2007",
        code=code_behind("verdict.py", "pneumo.papers.paper_2007.companion"),
    message:
        "Verdict on the paper of 2007"
    script:
        "../scripts/verdict.py"


use rule verdict_page as verdict_page_2007 with:
    input:
        verdict=rules.verdict_2007.output[0],
        templates=expand("pneumo/publish/pages/templates/{name}", name=VERDICT_TEMPLATES),
        about=["paper/2007/page.yaml", "paper/2007/findings.html.j2"],
    output:
        page=report("results/2007/verdict.html", caption="../captions/verdict.rst", category="Pages"),
    log:
        "results/logs/verdict_page_2007.log",
    message:
        "Verdict on the paper of 2007 as a page"


rule figure_2007:
    input:
        results=lookup("{drawn}/results", within=DRAWN_2007),
    output:
        figure=expand("results/2007/figures/{{drawn}}.{kind}", kind=["svg", "png"]),
    log:
        "results/logs/figure_2007_{drawn}.log",
    wildcard_constraints:
        drawn="|".join(DRAWN_2007),
    params:
        draw=lookup("{drawn}/draw", within=DRAWN_2007),
        code=code_behind("figure.py", "pneumo.publish.figures.conductance_figures"),
    message:
        "Figure {wildcards.drawn} of 2007"
    script:
        "../scripts/figure.py"
