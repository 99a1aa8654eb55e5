"""Write the checked study in SI units."""

from pneumo.physics.parameters import to_json
from pneumo.store import write_text

if __name__ == "__main__":
    write_text(to_json(snakemake.params.study), snakemake.output[0])  # noqa: F821
