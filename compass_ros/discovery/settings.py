"""The numbers that decide a verdict, together; each with where it comes from."""

from __future__ import annotations

import numpy as np

MOMENTS = 50
"""Moments of an episode at which pushes are given: 50 ms apart in the ordinary 2.5 s, a third of the least MEMORY_S."""
MEMORY_S = (0.15, 0.5, 1.5, 5.0)
"""Correlation lengths in time of the discrepancy [s], equally probable: from some frames to a constant of each
recording. With the first alone what varies slowly pays for what varies fast, and a wrong law is cheaper: of gusts
(`ball_flight_air` 1030001) the four have log evidences of 2624, 2698, 2715 and 2721 over none."""
RHO = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2)
RHO_PRIOR = (0.32, 0.21, 0.16, 0.15, 0.1, 0.06)
"""Size of the discrepancy of a law, as a share of the law's own: published forms of one law differ by 2 to 10 per
cent of it, and one that would need more than a fifth is another law (the study's table)."""
SHOWN, A_DECADE = float(np.log(99)), 2
"""Sizes of a discrepancy without a law are equally probable, so many a decade: up to all that moves and holds a site
(`at_work`), from the least that would be odds of 99 in recordings without it, for what they cannot show is no
explanation of them. An encoder of 0.2 mrad shows 1e-5 of what holds an arm."""
PRIOR_UNKNOWN = float(np.log(0.5))
PRIOR_LAW = float(np.log(0.5))
"""Log prior odds against the plain model: half of the probability is that nothing is missing, a quarter that of
`unknown`, a quarter that of all laws together."""
KEPT = 1e-3
"""Least variance of a component of a Gaussian process that is kept, as a share of the largest. Of a lens over a square
11 components leave 8 % (test_numerics.py); with 1e-2 there are 6, which leave half."""
SLIGHT = 0.01
"""Probability that is left to models that are not fitted any further: a budget. It is the default false-alarm rate and
does not follow that setting."""
