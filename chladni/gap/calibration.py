"""The free numbers of the diagnosis: what each means, its unit, where it comes from.

A number that is no definition, no unit and no format stands here and nowhere else in `chladni.gap`; physical bounds
of effects stand in the effects' own files. Where several rules ask the same thing they share a number. Shares and
ratios are words of a coarse scale: no rule is tuned more finely than from one word to the next.

Sources: a paper; *derived*; *measured*, on made machines or logs of others that were looked at, where a decision of
`docs/decisions` tells it by its number; else *chosen*, and nothing was measured.
"""

from math import cbrt, log
from sys import float_info

# Shares of a whole, without unit. Chosen: steps of about two, the coarsest scale that the rules tell apart.

#: A fit, a sensor or a plant doesn't tell so little: a thousandth. Chosen.
SLIGHT = 1e-3
#: Hardly any: quiet blocks too few to tell, values that a sensor may hold, the least that is left of a floor.
HARDLY_ANY = 0.05
#: A little: lags and fades of a record, what an effect begins a fit with, what outputs share of a residual by chance.
LITTLE = 0.1
#: Some: lines that are quiet, what a curve explains of a residual that is no noise, inputs that die out.
SOME = 0.2
#: A quarter: of a record, what a window takes at most; of time, what middling motion takes on either side. Chosen.
QUARTER = 0.25
#: Most: more than half. Derived.
MOST = 0.5

# Ratios of two powers, misfits or levels, without unit.

#: As good, of misfits on the same lines at the same parameters: 2 %. Chosen.
TIED = 1.02
#: As good, of places that are searched, and of levels. Chosen.
ALIKE = 1.1
#: Over the noise's power: what an unknown force leaves that explains all. Chosen.
ONE_FORCE = 1.15
#: Not the same any more: places, scatter of a machine that drifts, a share over the one that chance gives. Chosen.
SAME = 1.25
#: Over the noise's power: what a cause leaves that acts alone. Measured (decisions 0018, 0020).
ALONE = 1.3
#: Clearly more: misfits that segments tell apart, a floor in loud bands, a gap beyond its motion's share. Chosen.
CLEARLY = 1.5
#: A transient's power over that of later steps from period to period. Chosen.
TRANSIENT = 2.0
#: Far more: places and forms beyond it aren't looked at, runs beyond it are lost, a line stands out. Chosen.
FAR = 3.0
#: Power of a recovered force over its noise, from which a line that sticks out is believed. Measured (0016).
DOUBTED = 30.0
#: Misfit of a screened form over the best one's beyond which it isn't fitted. Chosen: it saves time alone.
UNLIKELY = 40.0
#: The same beyond which it isn't searched off its grid. Chosen: it saves time alone.
HOPELESS = 100.0
#: What more freedom must leave at most, of a misfit or a floor, to be worth it. Chosen.
LESS = 0.7
#: The same of two unknown forces over one. Measured (0025).
PAIR_GAIN = 0.6
#: Share of a gap that another place leaves beyond the best one, where the cause may still be. Measured: beside floors
#: that shook the next place left 0.02, beside a stop between a body and the ground that joint 0.0001.
NEAR = 0.003
#: Share of a gap that a law of a joint's motion leaves, where what acts follows that. Measured: of floors that shook
#: such laws left 0.2 to 0.5, of effects at that joint at most 0.12.
LEFT_BY_LAW = 0.15
#: Share of its speed below which a joint creeps, where a search begins: a steeper law has minima that no slope leads
#: out of. Chosen.
CREEP = 0.15

# What a log must hold.

#: Samples that tell anything from noise. Chosen.
FEWEST_SAMPLES = 32
#: Fewer blocks, lines or degrees of freedom scatter too much to be believed. Chosen.
FEWEST = 4
#: Samples a cycle with which a mode is followed between the samples. Chosen: Nyquist's two, and a quarter more.
SAMPLES_A_CYCLE = 2.5
#: Cycles that tell a signal's amplitude, or a frequency at all. Chosen.
CYCLES = 4.0
#: Cycles of the lowest mode that tell its frequency within a percent or so. Chosen.
CYCLES_ASKED = 20.0
#: Times of its slowest motion in which a model shows all that it does of itself. Derived: exp(-3) is 5 %.
TIMES = 3.0
#: Seconds of the same when nothing in a model has a time of its own. Chosen.
USUAL_S = 1.0
#: Degrees between patterns that are hard to tell apart in noise. Chosen.
NEAR_DEG = 10.0

# Noise and floor.

#: Noise over signal above which little can be said of anything. Chosen.
LOUD = 0.3
#: Highest order of an autoregressive noise (Ljung, System Identification, section 16.4, chooses below it). Chosen.
AR_ORDER = 12
#: Share of a signal's power that is always granted to noise: 80 dB, beyond most converters. Chosen.
GRANTED = 1e-8
#: Share of an output's RMS that no law of a catalogue is righter than. Measured: with 1 % two of fifty made cases
#: turned wrong, which hid in quiet bands of coloured noise, with 0.3 % one.
LAW_ERROR = 3e-3
#: Terms of a local polynomial, 1, r, r^2 (Pintelon and Schoukens 2012, section 7.2); as many poles but for the one.
LOCAL_TERMS = 3
#: Lines in a block over the unknowns of a fit there. Few follow a light resonance, many leave more to see. Chosen.
LINES_A_TERM = 3
#: Bands over which a sensor's noise is taken for flat. Chosen.
FLOOR_BANDS = 24
#: How faintly a sensor that the patterns take whole is wished to keep its noise, over what others say. Chosen.
FAINT_WISH = 0.02
#: Lines over which the power of an unknown force is taken for the same. Chosen.
SMOOTH = 31
#: Lines that a tone must stand out of. Chosen.
TONE_LINES = 201
#: Least share of an output that is told from noise. Derived of distortion: three sigma of fifteen blocks of three.
NOTICED = 0.03

# Evidence, see docs/methods/gap-explanation.md.

#: Independent numbers that what a law differs from the machine's by is worth, along its own force. Measured on
#: made cases, as the next.
DETAILS = 8.0
#: The same elsewhere.
ELSEWHERE = 60.0
#: Share of its force, as RMS, that a right law leaves at most, usually: a sixth. Chosen.
USUAL = 0.1667
#: Independent numbers that what goes beyond is worth. Chosen.
UNUSUAL = 20.0
#: Share as `USUAL` from which on another word may do better: looking costs no name. Chosen.
OPEN = 0.1
#: Share of a floor's power that it is uncertain by beyond its degrees of freedom. Chosen: bias of a local fit, drift.
DOUBT = 0.05
#: Standard deviations, or doubts of a floor, within which something may be as it's said. Derived: 95 %.
SIGMAS = 2.0
#: e-folds: one sigma of an effect's number before a log is seen. Chosen: a factor of seven each way.
SIZE = 2.0
#: Samples that a log is taken for, whatever its length, where states at windows pay (decision 0020). Chosen; a log of
#: fewer is short.
EFFECTIVE_SAMPLES = 200

# Belief and names.

#: Prior odds of one more cause: machines lack one thing more often than two. Chosen.
ANOTHER = 0.1
#: Share of the gap's power that a cause must have to be named: less is what a model is rounded by. Chosen.
LEAST_SHARE = 0.02
#: Probability from which a name is given: more probable than not. Derived.
NAMED = 0.5
#: Nats that count as one, for lines and sensors miss what a model lacks together. Measured on 40 made machines of two
#: generators and 12 logs of others, as the next.
TEMPER = 5.0
#: Probability that all that was weighed is wrong.
LAPSE = 0.03
#: Nats within which a log can't tell two candidates apart. Chosen: odds of e^2 when they are printed.
CLOSE = SIGMAS * TEMPER
#: Probability with which an answer set, or an interval, holds the truth. Chosen, as usual.
COVERAGE = 0.95
#: Nats that are worth another move: less pays for no name. Chosen.
WORTH = 12.0
#: Probability of a floor that shakes, and of a lattice: neither is a contest of likelihoods. Chosen.
UNWEIGHED = 0.9
#: Nats by which a hold, or a further measurement, must lead, since all stands on it. Chosen: odds of 1000 to one.
BEYOND_DOUBT = log(1000.0)

# Values of parameters.

#: Sigmas of its tolerance beyond which a parameter is wrong, not uncertain; of an estimate, beyond chance. Derived:
#: one in 370.
OUTSIDE = 3.0
#: e-folds: one sigma of a wrong value. Chosen: a wrong unit or formula is a factor of two to three.
SLIP = log(3.0)
#: e-folds: the furthest that a wrong value is searched. Chosen: a slip of the pen is a factor of ten.
FURTHEST = log(30.0)
#: The furthest factor that a search for it begins at. Chosen, as above.
SLIP_FACTOR = 10.0
#: Share of its usual range that a signed number of an effect that begins at zero steps by: its `SIZE`. Chosen.
SHARE_OF_RANGE = 0.02

# How much is searched: each costs time alone, and more finds no less. Chosen, so that a diagnosis takes seconds.

#: Leads beside which a search of its own looks for another cause; forms of one word at one site.
LEADS = 2
#: Rounds of that, and causes up to which two are looked for at once.
CAUSES = 2
#: Places, joints, pairs or rivals that are each profiled, or followed, on their own.
PLACES = 3
#: Forms that are each fitted beside another cause, or with details.
FORMS = 4
#: Places that are followed to the end; at most twice as many, where they aren't told apart.
LOCATED = 5
#: Forms that are each fitted in free run.
FITS = 7
#: Fits that are each begun again, or begun beside a doubted value.
BEGUN = 8
#: Of what costs little each: forms that are searched beyond their grid, and fitted while all leave something.
MANY = 16
#: Periods of the lowest mode that segments last, one after another: short ones forgive a resonance elsewhere.
SEGMENTS = (2.0, 8.0, 24.0)
#: Lines that a problem is weighed on.
LINES = 1500
#: Points of a law of any shape along one motion. Derived: of n samples of noise it explains 60/n.
LAW_POINTS = 60
#: Points of the same of the pace beside it.
PACE_POINTS = 16
#: Samples of a filter of any shape.
FILTER_SAMPLES = 24

# Windows and what is held out.

#: Every so manieth block, and part of a window, is held out; windows grow by so many.
THIRDS = 3
#: Seconds of a block that is held out. Chosen: several cycles of most machines.
BLOCK_S = 0.75
#: Samples of a window at least. Chosen.
SHORTEST_WINDOW = 20
#: Ratio by which a misfit grows with its windows when the run parted from the log's. Chosen.
PARTED = 10.0

# Fits.

#: Nats: a step that promises less changes no decision. Chosen: a fiftieth of `TEMPER`.
PRECISION = 0.1
#: Share of a cost that a further step must gain, where that's rough: coarse runs, screened forms. Chosen.
GAINED = 0.01
#: Sigmas of a parameter, and e-folds of an effect's number, that one step may take. Chosen.
LONGEST = 2.0
#: Part of a step that is tried when all of it leads nowhere. Chosen.
SHORTER = 0.3
#: Dampings of a step that are tried beside none, by tens up to ten. Chosen.
DAMPINGS = 7
#: Iterations of an output-error fit. Chosen: most fits end before.
ITERATIONS = 12
#: Iterations of a profile over linear problems; a place among many gets half, a pair a quarter. Chosen.
PROFILE_STEPS = 8
#: Iterations of what converges by itself. Chosen: they end before.
MOST_STEPS = 60
#: How many times wider than all that is thought of a prior is that shall be none. Chosen.
WIDE = 10.0

# Numerics, relative and without unit. Chosen between rounding and what an answer would notice.

#: Of a parameter's sigma, or of an e-fold: a step of differences of equations.
STEP = 1e-5
#: Of an e-fold: the same of runs of somebody else's program, large against the jitter that friction leaves in them.
JITTER = 1e-2
#: No answer notices so little: tolerances of runs and clocks, bounds, priors that keep equations regular.
UNNOTICED = 1e-6
#: But for this two patterns, or signals, are the same.
ROUNDING = 1e-9
#: Of the largest singular value: below it columns are the same but for rounding.
RANK = 1e-10
#: What is added to a matrix that rounding may leave singular.
RIDGE = 1e-12
#: Less is nothing, and divisors are no less: its square, and another over its square, still are numbers.
ZERO = cbrt(float_info.min)
#: A law, a motion or a slope beyond it left the numbers: its square still is one.
RUNAWAY = cbrt(float_info.max)
#: Lines of a spectrum from 0 to half the sample rate.
GRID = 1024
#: Steps between samples of a model with laws.
PARTS = 8

# Memory and threads.

#: Threads at most: each fit holds arrays as long as the log.
THREADS = 4
#: Results of one kind that are kept: two for each thread.
KEPT = 2 * THREADS
#: Bytes that are spare beside a diagnosis, which needs half of 500 MB.
SPARE_BYTES = 268_435_456

# Plants that only respond.

#: Sigmas of a parameter between two runs that tell a slope: large against what friction leaves. Chosen.
NUDGE = 0.05
#: Sigmas to which parameters are rounded where slopes and pulses are asked for: neighbours share them. Chosen.
Z_GRID = 0.5
#: Samples of an answer before its pulse: a law is asked a step before, and an accelerometer feels it there. Derived.
AHEAD = 2

# What is told of a gap, for people.

#: Bands of frequency, without a model's modes.
BANDS = 10
#: Share of the power on either side of a band in which something moved: 99 % lie inside.
TAIL = 0.005
#: Lines that tell a frequency from its neighbours, or from a drift.
LINES_APART = 3
#: Pieces of a record whose gaps are held against each other.
PIECES = 64
#: Samples of the shortest piece, or period; neighbouring lines that share a resonance.
BLOCK = 8
#: Draws of a bootstrap.
DRAWS = 1000
#: Names in one sentence, rows of one list.
LISTED = 6
