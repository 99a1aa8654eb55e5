# A cylinder in the browser: `snakemake -j2 live`. Needs clang and its linker for WebAssembly, and says so without them.


rule live:
    input:
        parameters=rules.parameters.output[0],
        templates=expand(
            "pneumo/export/templates/{name}.j2",
            name=["model.c", "model.h", "test.c", "live.c", "wasm_math.h"],
        ),
        sources=[f"docs/live/{name}" for name in ("frame.html", "live.html", "live.css", "live.js")],
    output:
        page="<results>/live.html",
    log:
        "<results>/logs/live.log",
    params:
        code=code_behind("live.py"),
        n=1.35,
    message:
        "The full order and every model in the browser"
    script:
        "../scripts/live.py"
