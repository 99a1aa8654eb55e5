"""The paper of 2006: its folder, computations, proofs and highlights, for `pneumo.verdict.judging`."""

from pneumo.papers.paper_2006.computations import COMPUTATIONS
from pneumo.papers.paper_2006.erratum_proofs import PROOFS
from pneumo.papers.paper_2006.summary import highlights
from pneumo.verdict import PAPER_FOLDER
from pneumo.verdict.judging import Paper

PAPER_2006 = Paper(PAPER_FOLDER, COMPUTATIONS, PROOFS, highlights, module=__name__)
