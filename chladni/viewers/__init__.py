"""Pictures of a study: rerun, matplotlib figures, HTML report; they draw results and compute nothing."""
