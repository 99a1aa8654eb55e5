# The stages of a study, each from the one before.


include: "simulate.smk"
include: "assess.smk"
include: "publish.smk"
include: "second_paper.smk"
include: "cylinder_ranking.smk"
include: "evidence.smk"
include: "manuscript.smk"


rule paper:
    input:
        rules.settling.output,
        rules.datum.output,
        rules.replay.output,
        rules.statistics.output,
        rules.schemes.output,
        rules.figures.output,
        rules.verdict.output,
        rules.simulated_example.output,
        rules.verdict_2007.output,
        rules.report.output,
