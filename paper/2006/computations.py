"""What the files beside it name: ``paper-verdict check paper/2006``, in the checkout's folder."""

from paper.study.paper_2006.paper import PAPER_2006 as PAPER

__all__ = ["PAPER"]
