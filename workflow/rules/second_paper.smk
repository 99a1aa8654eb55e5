# The paper of 2007: its simulated example, verdict and page. It needs no result of the study.


rule simulated_example:
    output:
        response="<results>/2007/example.nc",
    log:
        "<results>/logs/simulated_example.log",
    params:
        code=sha256_of("workflow/scripts/simulated_example.py"),
    message:
        "Simulated example of 2007"
    script:
        "../scripts/simulated_example.py"


rule verdict_2007:
    input:
        evidence=[],
        example=rules.simulated_example.output.response,
        claims="paper/2007/claims.yaml",
        facts="paper/2007/facts.yaml",
        errata="paper/2007/errata.yaml",
        assumptions="paper/2007/assumptions.yaml",
        published=expand("paper/2007/published/table{number}.csv", number=range(1, 6)),
        quoted="paper/2007/published/quoted.csv",
        about=["paper/2007/paper.yaml", "paper/2007/findings.html.j2"],
    output:
        judged="<results>/2007/verdict.json",
        page=report("<results>/2007/verdict.html", caption="../captions/verdict.rst", category="Pages"),
    log:
        "<results>/logs/verdict_2007.log",
    params:
        name="2007",
        code=sha256_of("workflow/scripts/verdict.py", "paper/study/paper_2007/paper.py"),
    message:
        "Verdict on the paper of 2007, and its page"
    script:
        "../scripts/verdict.py"
