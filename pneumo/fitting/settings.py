"""Limits and choices of fits that one may want to change; constants of numerics stay where they are used."""

# What is fitted.
LEVEL = 0.95  # of intervals
PART = 0.6  # of a record that is fitted; the rest is held out
MOST_STEPS = 60_000  # of the part fitted: a minute at 1 kHz; more tells no more and takes gigabytes

# Which models are as good as the best, and which intervals say enough.
AS_GOOD = 1.05  # error on the part held out over the lowest, up to which models are equally good
LAWS_ALIKE = 0.01  # difference of k_0 between the mean over laws of the wall and one law, that goes unsaid
VAGUE, ROUGH = 3.0, 1.5  # upper over lower end of an interval that says little, and of one to be checked
# The same of a parameter that may be zero: the fractions of its search that those ratios are of k_0's search.
VAGUE_PART, ROUGH_PART = 0.14, 0.05
# Interval over the one that the configuration states, above which the record adds little: alone it would give
# an interval over 4/3 times as wide as the configuration's (1 / 0.8^2 - 1 = 0.75^2).
OF_STATED = 0.8

REACHED = 0.9  # largest command over u_max, below which C at u_max is extrapolated

# When a fit is doubted.
SEEN = 0.2  # residual that is not white over the sensor's noise, below which it is not seen
COLOURED = 0.4  # the same, above which noise does not explain it
FAR = 1.0  # the same, above which intervals mean nothing
# Half-widths, on the search's scale, by which residuals that are not noise may move a parameter unsaid.
TOLERATED = {"k_0": 0.15, "k_xu": 0.03, "V_d_A": 0.05, "V_d_B": 0.05}
DISTRUST = 5.0  # times that, beyond which intervals mean nothing
ALLOWED = 3.0  # residual over the standard deviation of what a configuration within its accuracy leaves
OUTSIDE = 3.0  # standard deviations of its accuracy, beyond which a configured quantity is wrong
UNLIKELY = 2.0  # factor between a fitted and the configured dead volume
# Error of the full order on the part held out over that on the part fitted, beyond which something changed.
# Undisturbed records, configured exactly, have at most 1.12; `ALLOWED` is for what is configured.
CHANGED = 1.4
EARLY = 0.1  # samples by which a valve may act before its command: no clock is better
SURE = 2.0  # deviation of a stop over what the stated accuracies allow
MOVED = 0.05  # of a dead volume, by which an error of the position moves it unsaid

# When a cause is named.
EXPLAINED = 0.5  # residual that is not noise with a cause over that without
TIED = 1.5  # the same over that with the best cause, up to which both are named
BETTER = 0.5  # error with a corrected column over that as given, below which a mistake is likely

# Records of closed chambers.
FEWEST_SAMPLES = 50
LARGEST_MOTION = 0.02  # of a piston that is held, over its stroke
