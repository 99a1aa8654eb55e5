# What the study rests on, apart from the study itself: `snakemake -j2 evidence`.


rule identification:
    input:
        parameters=rules.parameters.output[0],
        published=expand("paper/published/table{number}.csv", number=[5, 7, 9]),
    output:
        "results/identification.nc",
    log:
        "results/logs/identification.log",
    threads: workflow.cores
    params:
        code=code_behind("identification.py"),
    message:
        "Identification of M, k_f, stop, amplitudes and transport from Tables 5, 7 and 9"
    script:
        "../scripts/identification.py"


rule identification_figure:
    input:
        rules.identification.output,
    output:
        expand("results/figures/identification.{kind}", kind=["svg", "png"]),
    log:
        "results/logs/identification_figure.log",
    params:
        code=code_behind("identification_figure.py"),
    message:
        "Figure of the identification"
    script:
        "../scripts/identification_figure.py"


rule evidence:
    input:
        rules.identification_figure.output,
