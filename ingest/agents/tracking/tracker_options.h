// SPDX-License-Identifier: Apache-2.0
// Who is who: all numbers that decide it.
#pragma once

#include <vector>

#include "ingest/agents/estimation/torso_options.h"
#include "ingest/config/option_field.h"
#include "schema/base/time.h"

namespace dsg::ingest {

/// How fast the scatter of shapes is learnt.
struct ShapePrior {
  /// What is assumed counts as so many detections, and as so many people.
  double noise_count = 50.0;
  double person_count = 10.0;
  /// A network errs alike from image to image: a mean never gets better than this share of the
  /// noise.
  double shared_noise = 0.06;
};

struct TrackerOptions {
  TorsoOptions torso;
  /// Every joint moves at most this far in one second against the track's last skeleton, and not
  /// less is allowed within a second. Source: RSS 2020, section IV-A ("3 m").
  double joint_speed_m_s_max = 3.0;
  /// The paper's association: a detection joins the first consistent track; the default assigns
  /// all of an image at once.
  bool is_first_consistent = false;
  /// Squared Mahalanobis distance, three degrees of freedom at 99 %.
  double gate = 11.34;
  /// What a pair costs besides: the joints' mean distance, a metre; the shapes' squared distance.
  double joint_weight_per_m = 0.1;
  double shape_weight = 0.2;
  /// What leaving an observation alone costs: more than any consistent pair, whose cost is cut
  /// below it, so that one bad pair does not break two good ones.
  double alone_cost = 16.0;
  /// A tentative track is confirmed after so many hits within confirm_ns; the paper's with its
  /// first node.
  int confirm_hit_count = 3;
  int paper_confirm_hit_count = 1;
  TimeNs confirm_ns = 1'000'000'000;
  /// Unseen for longer, a track is closed (a tentative one is dropped after confirm_ns).
  TimeNs close_ns = 5'000'000'000;
  /// Unseen for longer, the place alone no longer says who somebody is: shapes must agree too.
  TimeNs coast_ns = 1'500'000'000;
  /// Closed tracks may be found again for so long.
  TimeNs again_ns = 600'000'000'000;
  /// Fastest walk for being found again elsewhere, m / s.
  double again_speed_m_s = 2.0;
  /// Least log-likelihood ratio of the shapes for being the same person.
  double again_ratio_min = 3.0;
  /// Found again with at least this probability, a track goes on; below, it gets a SameAs.
  double again_probability_min = 0.99;
  /// The same for a single detection, before it has made a track of its own.
  double again_at_once_probability_min = 0.999;
  /// Standard deviations of each shape coefficient, of one detection and among people, until the
  /// tracker has learnt better from what it sees.
  double shape_noise_sigma = 0.4;
  double shape_spread_sigma = 1.0;
  ShapePrior shape_prior;
  /// Squared Mahalanobis distance of shapes within a track: ten degrees of freedom at 99.99 %.
  double shape_gate = 35.0;
  /// The same for being found again: at 99 %.
  double again_shape_gate = 23.2;
  /// Observations so near to one of a track, with a shape like the track's, are a second box about
  /// the same body.
  double duplicate_m = 0.5;
  /// Of the position of weak observations.
  double weak_sigma_factor = 2.0;

  std::vector<BoundOption> Bind();
};

/// As the paper has it: each detection joins the first consistent track or opens one; nobody is
/// found again.
/// Source: RSS 2020, section IV-A ("Human Nodes").
TrackerOptions PaperTrackerOptions();

}  // namespace dsg::ingest
