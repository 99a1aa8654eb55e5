# The paper's study from configuration to figures: `snakemake -j2`.
# Another study on top of it: `snakemake -j2 --configfile config/smoke.yaml`.
# Cylinders of one's own, from `pneumo init`: `snakemake -j2 --configfile my.yaml`.
import shlex
import sys

from snakemake.utils import min_version

from pneumo.jobs.checked_study import checked_study, k_0_factors, own_cylinders
from pneumo.jobs.rerun_triggers import code_behind, evidence_for, fingerprints, kept_or_made
from pneumo.jobs.run_lock import take_run_lock

min_version("9.0")
sys.executable = shlex.quote(sys.executable)  # Snakemake 2645: a checkout's path may hold a space


configfile: "config/paper.yaml"


onstart:
    if workflow.is_main_process:
        take_run_lock()


STUDY = checked_study(config, workflow.config_settings.configfiles, workflow.config_settings.config)
TRANSPORTS = ["published", "exact"]
OWN_CYLINDERS = own_cylinders(STUDY)  # of a study that is not the paper's
K_0_FACTORS = k_0_factors(config)  # within which k_0 is known, by cylinder


include: "workflow/rules/common.smk"
include: "workflow/rules/simulate.smk"
include: "workflow/rules/assess.smk"
include: "workflow/rules/publish.smk"
include: "workflow/rules/second_paper.smk"
include: "workflow/rules/own.smk"
include: "workflow/rules/ensemble.smk"
include: "workflow/rules/cylinders.smk"
include: "workflow/rules/at_work.smk"
include: "workflow/rules/evidence.smk"
include: "workflow/rules/live.smk"
include: "workflow/rules/manuscript.smk"


rule paper:
    input:
        rules.parameters.output,
        rules.settling.output,
        rules.settling_table.output,
        rules.datum.output,
        rules.replay.output,
        rules.statistics.output,
        rules.schemes.output,
        rules.figures.output,
        rules.tables.output,
        rules.verdict.output,
        rules.verdict_page.output,
        rules.verdict_2007.output,
        rules.verdict_page_2007.output,
        expand("results/2007/figures/{name}.{kind}", name=DRAWN_2007, kind=["svg", "png"]),
        rules.report.output,


rule all:
    default_target: True
    input:
        rules.own.input if OWN_CYLINDERS else rules.paper.input,
