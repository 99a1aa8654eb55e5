"""Write the checked study in SI units."""

from pneumo.configuration.exchange import to_json
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import write_json

if job := globals().get("snakemake"):
    with logged(job):
        write_json(to_json(job.params.study), job.output[0])
