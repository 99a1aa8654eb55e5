# A cylinder in the browser: `snakemake -j2 live`. Needs clang and its linker for WebAssembly, and says so without them.


rule live:
    input:
        sources=[f"docs/live/{name}" for name in ("frame.html", "live.html", "live.css", "live.js")],
    output:
        page="<results>/live.html",
    log:
        "<results>/logs/live.log",
    params:
        study=STUDY,
        code=sha256_of(
            *SIMULATION,
            "pneumo/equations",
            "pneumo/export",
            "pneumo/linear",
            "pneumo/statistics",
            "pneumo/publish",
        ),
        n=1.35,
    message:
        "The full order and every model in the browser"
    script:
        "../scripts/live.py"
