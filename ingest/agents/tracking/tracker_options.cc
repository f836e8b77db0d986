// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/tracking/tracker_options.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<TrackerOptions> kFields[] = {
    {"track-joint-speed", &TrackerOptions::joint_speed_m_s_max, 0.1, 100.0,
     "How far a joint moves in a second at most, metres: RSS 2020 has 3"},
    {"track-gate", &TrackerOptions::gate, 0.1, 1000.0,
     "Squared Mahalanobis distance of a detection from its track at most: 99 % of three degrees of "
     "freedom"},
    {"track-joint-weight", &TrackerOptions::joint_weight_per_m, 0.0, 100.0,
     "What a metre of distance of the joints counts against a pair, in squared standard "
     "deviations: it decides between equals"},
    {"track-shape-weight", &TrackerOptions::shape_weight, 0.0, 100.0,
     "What the squared distance of the shapes counts against a pair: ten coefficients err "
     "together"},
    {"track-alone-cost", &TrackerOptions::alone_cost, 1.5, 10000.0,
     "What leaving a detection alone costs: more than any pair that fits, so that one bad pair "
     "does not break two good ones"},
    {"track-hits", &TrackerOptions::confirm_hit_count, 1, 1000,
     "Detections within track-confirm that make a track: two may be a picture on a wall"},
    {"track-paper-hits", &TrackerOptions::paper_confirm_hit_count, 1, 1000,
     "The same with --people paper: RSS 2020 begins a graph with a single pose"},
    {"track-confirm", &TrackerOptions::confirm_ns, 0.0, 3600.0,
     "A track is made within this, and lost when unseen for longer, seconds: somebody in sight is "
     "detected several times a second"},
    {"track-close", &TrackerOptions::close_ns, 0.0, 3600.0,
     "Unseen for longer, a track is closed, seconds: by then somebody may be in another room"},
    {"track-coast", &TrackerOptions::coast_ns, 0.0, 3600.0,
     "Unseen for longer, shapes must agree too, seconds: the place alone says who it is no more"},
    {"track-again", &TrackerOptions::again_ns, 0.0, 86400.0,
     "Closed tracks may be found again for so long, seconds: ten minutes"},
    {"track-again-speed", &TrackerOptions::again_speed_m_s, 0.0, 100.0,
     "Fastest walk for being found again elsewhere, metres / second: a brisk one"},
    {"track-again-ratio", &TrackerOptions::again_ratio_min, 0.0, 50.0,
     "Least log-likelihood ratio of the shapes for being the same person: twenty to one"},
    {"track-again-probability", &TrackerOptions::again_probability_min, 0.0, 1.0,
     "Found again with at least this probability, a track goes on, below it gets a same-as: a "
     "wrong union is worse than two tracks"},
    {"track-again-at-once", &TrackerOptions::again_at_once_probability_min, 0.0, 1.0,
     "The same for a single detection: one shape alone says less"},
    {"track-shape-noise", &TrackerOptions::shape_noise_sigma, 0.001, 100.0,
     "Standard deviation of each shape coefficient of a detection, until better is learnt: of "
     "good networks"},
    {"track-shape-spread", &TrackerOptions::shape_spread_sigma, 0.001, 100.0,
     "The same among people: SMPL's coefficients are scaled to 1"},
    {"track-shape-gate", &TrackerOptions::shape_gate, 0.1, 10000.0,
     "Squared Mahalanobis distance of shapes within a track at most: 99.99 % of ten degrees of "
     "freedom"},
    {"track-again-shape-gate", &TrackerOptions::again_shape_gate, 0.1, 10000.0,
     "The same for being found again: 99 %"},
    {"track-duplicate", &TrackerOptions::duplicate_m, 0.0, 10.0,
     "Detections of a like shape this near to a track's of the same image are a second box about "
     "the body, metres: two people keep farther apart"},
    {"track-weak", &TrackerOptions::weak_sigma_factor, 1.0, 100.0,
     "How many times larger the error of a body is that the border cuts off: half a person tells "
     "less of where the torso is"},
};

constexpr OptionField<ShapePrior> kShapeFields[] = {
    {"track-shape-noise-count", &ShapePrior::noise_count, 0.1, 1e6,
     "track-shape-noise counts as so many detections: as a person seen for some seconds"},
    {"track-shape-person-count", &ShapePrior::person_count, 0.1, 1e6,
     "track-shape-spread counts as so many people: fewer say nothing of a spread"},
    {"track-shape-shared", &ShapePrior::shared_noise, 0.0, 1.0,
     "Share of the noise that a mean keeps however many detections it has: a network errs alike "
     "from image to image"},
};

}  // namespace

std::vector<BoundOption> TrackerOptions::Bind() {
  std::vector<BoundOption> bound = torso.Bind();
  BindFields<TrackerOptions>(kFields, this, &bound);
  BindFields<ShapePrior>(kShapeFields, &shape_prior, &bound);
  return bound;
}

TrackerOptions PaperTrackerOptions() {
  TrackerOptions options;
  options.torso.model = TorsoModel::kPaper;
  options.is_first_consistent = true;
  return options;
}

}  // namespace dsg::ingest
