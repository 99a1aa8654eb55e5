"""Write the checked study in SI units."""

from pneumo.physics.parameters import to_json
from pneumo.store import write_text
from pneumo.workflow import logged

if job := globals().get("snakemake"):
    with logged(job):
        write_text(to_json(job.params.study), job.output[0])
