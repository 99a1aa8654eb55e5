"""What the files beside it name: ``paper-verdict check paper/2007``, in the checkout's folder."""

from paper.study.paper_2007.paper import PAPER_2007 as PAPER

__all__ = ["PAPER"]
