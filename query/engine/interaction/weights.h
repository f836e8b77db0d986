// SPDX-License-Identifier: Apache-2.0
// The numbers of the evidence model, natural logarithms of odds unless they have a unit.
// They were fitted to simulated people, not measured on real ones.
//
// Source: conditional logit (McFadden, 1974) by tests/eval/interactions_fit.cc over 1375 changes of
// simulated worlds of seeds 1 to 5: apartments, wings and offices with 3 to 24 people, watched by
// cameras, by glances and by a robot. Rounded, and where the fit said more than common sense would,
// only part of the way: people of the simulator carry everything straight to where they put it.
// Set by reasoning: kFoundAnew, kMovedAside, kHeldMax, kFalseChange and its slope, the two
// thresholds.
#pragma once

namespace dsg::query::weights {

/// Hand to box while it is taken, one standard deviation, metres (the box's own error included).
inline constexpr double kHandSigmaM = 0.24;
/// Log density of a hand at distance 0 against one anywhere within reach.
inline constexpr double kHandAtBox = 4.0;
/// No further than this below: a detector may have seen the body only before and after.
inline constexpr double kHandFloor = -3.6;
/// Within reach and no hand was seen, or not all the time.
inline constexpr double kHandUnseen = 0.1;
/// Never seen within reach, but it may have been while nobody looked; and times log(1 + seconds of
/// that / 2 s).
inline constexpr double kMayVisit = -2.5;
inline constexpr double kMayVisitTime = 0.7;
/// Times log(1 + seconds within 0.8 m / 2 s); whoever sits there for longer takes nothing for it.
inline constexpr double kDwell = 1.4;
inline constexpr double kDwellMaxS = 10.0;
/// The visit began after the object was last seen and ended before it was first missed. The fit
/// found next to nothing in this, nor in the next one.
inline constexpr double kVisitWindow = 0.1;
/// Times the share of the visit in gaps.
inline constexpr double kUnobserved = -0.1;
/// In the room, and never within reach.
inline constexpr double kOutOfReach = -4.7;
/// Put: times log(1 + seconds from the hand to the first sight of the object / 10 s), as whoever
/// looks finds it soon.
inline constexpr double kDelay = -1.5;
/// A thing of the class appeared where the agent went.
inline constexpr double kCarried = 2.2;
/// Somebody whom nobody saw, a second of the interval in which no agent was within reach.
inline constexpr double kUnseenRatePerS = 0.002;
/// The same where the map's robots were elsewhere, and could see nobody.
inline constexpr double kUnwatchedRatePerS = 0.008;
/// Nothing happened: the mapper was wrong. Less for each observation of the object.
inline constexpr double kFalseChange = 1.0;
inline constexpr double kFalseChangePerObservation = -0.15;
/// Nobody put it there: it was overlooked until then; and where a robot looked in passing.
inline constexpr double kOverlooked = 1.8;
inline constexpr double kOverlookedInPassing = 3.5;
/// Found anew where it was, or SAME_AS something within reach of there. More than all that a visit
/// can weigh, since moved beats taken.
inline constexpr double kFoundAnew = 12.0;
/// A new thing of its class within reach of where it was, once it was missed: shoved aside, or
/// another that was put there. No more, with kFalseChange, than a hand at the box.
inline constexpr double kMovedAside = 3.0;
static_assert(kMovedAside + kFalseChange <= kHandAtBox);
/// Seen in somebody's hand: the log odds of that, at most; less what then is left for nothing
/// having happened.
inline constexpr double kHeldMax = 4.0;

/// The best must be at least this probable, and ahead of the next by so much.
inline constexpr double kProbabilityMin = 0.6;
inline constexpr double kMarginMin = 0.2;

}  // namespace dsg::query::weights
