# The paper's study from configuration to figures: `snakemake -j2`.
# Another study on top of it: `snakemake -j2 --configfile config/smoke.yaml`.
# Your own cylinders, from `pneumo init`, or a table of them: `snakemake -j2 --configfile my.yaml`.
import shlex
import sys
from pathlib import Path

from snakemake.utils import min_version

sys.path.insert(0, "")  # the checkout, for what is not installed
from paper.study.kept_evidence import evidence_for, kept_or_made
from paper.study.labels import shown
from workflow.jobs.checked_study import (
    as_written,
    checked_study,
    find_checkout,
    limits_of_cylinders,
    results_folder,
    user_cylinders,
    without_trust,
)
from workflow.jobs.checksums import write_sums
from workflow.jobs.fleet_plan import checked_fleet
from workflow.jobs.rerun_triggers import sha256_of
from workflow.jobs.run_lock import check_run_folder, take_run_lock

find_checkout()
min_version("9.27")
sys.executable = shlex.quote(sys.executable)  # Snakemake 2645: a checkout's path may hold a space

if workflow.is_main_process:
    check_run_folder(workflow.basedir)


configfile: "config/paper.yaml"


onstart:
    if workflow.is_main_process:
        take_run_lock(RESULTS)


onsuccess:
    if workflow.is_main_process:
        write_sums(Path(RESULTS))


# Cylinders in a table are planned without the paper's study; jobs need not check every row again.
FILES = workflow.config_settings.configfiles
OPTIONS, TRUST = without_trust(
    workflow.config_settings.config
)  # --config trust=true, as `pneumo study --trust`
config.pop("trust", None)
config.update(as_written(FILES, OPTIONS))
RESULTS = results_folder(FILES, OPTIONS)
FLEET = checked_fleet(config, FILES, OPTIONS, check=workflow.is_main_process, trust=TRUST)


pathvars:
    results=RESULTS,  # what <results> in the rules stands for


include: "workflow/rules/common.smk"


if FLEET:

    include: "workflow/rules/fleet.smk"

else:
    STUDY = checked_study(config, FILES, OPTIONS, trust=TRUST)
    TRANSPORTS = ["published", "exact"]
    USER_CYLINDERS = user_cylinders(STUDY)  # of a study that is not the paper's
    LIMITS = limits_of_cylinders(config)  # within which wall, valve and dead volumes are known

    include: "workflow/rules/study.smk"


rule all:
    default_target: True
    input:
        rules.fleet.input if FLEET else rules.cylinder_ranking.input if USER_CYLINDERS else rules.paper.input,
