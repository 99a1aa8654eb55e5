"""Write the checked study in SI units."""

from pneumo.job import logged
from pneumo.physics.exchange import to_json
from pneumo.store import write_json

if job := globals().get("snakemake"):
    with logged(job):
        write_json(to_json(job.params.study), job.output[0])
