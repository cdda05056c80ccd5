#include "vision/track/dot_tracks.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <set>

#include "data/input_error.h"
#include "data/median.h"
#include "data/parallel.h"
#include "vision/detect/tag_family.h"
#include "vision/track/dot_bend.h"
#include "vision/track/dot_identity.h"
#include "vision/track/dot_lattice.h"
#include "vision/track/dot_layout.h"

namespace clothfit {
namespace {

double half_level(const Dot& dot) {
  return dot.paper_levels * (1 - 0.5 * dot.contrast);
}

/// Returns the misfit that noise does not explain; it is itself known to a tenth.
double excess_misfit(const Dot& dot) {
  const double noise = dot.noise_levels / std::abs(dot.contrast * dot.paper_levels);
  return std::sqrt(std::max(dot.misfit * dot.misfit - 1.5 * noise * noise, 0.0));
}

/// Returns the median of a quantity over the placed dots, and `least` where it is less.
template <class Quantity>
double usual(const PlacedDots& placed, double least, Quantity quantity) {
  std::vector<double> values;
  for (const std::optional<Dot>& dot : placed.dots)
    if (dot) values.push_back(quantity(*dot));
  return values.empty() ? least : std::max(median(std::move(values)), least);
}

/// Returns the width of a quadrilateral across its longer diagonal.
double thickness_px(const std::array<Eigen::Vector2d, 4>& corners) {
  const Eigen::Vector2d one = corners[2] - corners[0], other = corners[3] - corners[1];
  return 0.5 * std::abs(one.x() * other.y() - one.y() * other.x()) /
         std::max({one.norm(), other.norm(), 1.0});
}

}  // namespace

/// The state between pictures.
class DotTracker::Follower {
 public:
  Follower(const MarkerSet& markers, const std::string& file, const DotTrackOptions& options);
  DotFrame next(const cv::Mat& grey);

 private:
  /// Where a site was seen last.
  struct SiteHistory {
    std::optional<Dot> last;                   ///< in the picture before
    std::optional<Eigen::Vector2d> before_px;  ///< its centre one picture earlier
  };
  /// A dot sought where its neighbours expect it, and not taken.
  struct Attempt {
    LocalMap map;
    Dot dot;
  };
  /// The picture's own working set.
  struct Working {
    explicit Working(size_t sites)
        : placed(sites), reason(sites, nullptr), attempt(sites), followed(sites), maps(sites) {}
    PlacedDots placed;
    DotScale scale;
    bool mirrored = false;  ///< the sheet appears as in a mirror
    std::vector<TagDetection> tags;
    std::vector<const char*> reason;              ///< by site; null: not known
    std::vector<std::optional<Attempt>> attempt;  ///< by site, the last one
    std::vector<bool> followed;                   ///< by site: from the picture before
    std::vector<LocalMap> maps;                   ///< by site, itself included, once all is placed
  };

  void search_whole(const cv::Mat& grey, Working& working);
  Working follow(const cv::Mat& grey);
  std::optional<PredictedTag> predicted_anchor(int tag, const SitePlaces& places) const;
  void find_tags_nearby(const cv::Mat& grey, Working& working);
  void search_around(const cv::Mat& grey, const PredictedTag& anchor,
                     std::vector<TagDetection>& tags);
  void place_tag_corners(Working& working) const;
  bool tags_agree(const Working& working) const;
  bool pattern_agrees(Working& working) const;
  void complete(const cv::Mat& grey, Working& working) const;
  int complete_once(const cv::Mat& grey, Working& working, double blur_px) const;
  DotScale measure(Working& working) const;
  void leave_out_unanchored(Working& working) const;
  std::vector<bool> anchored_sites(const Working& working) const;
  std::vector<bool> sites_of_their_size(const Working& working) const;
  void leave_out_cut(Working& working) const;
  void say_why_missing(const cv::Mat& grey, Working& working) const;
  const char* why_missing(const cv::Mat& grey, const Working& working, size_t site) const;
  bool is_search_due(const Working& working) const;
  DotFrame report(const Working& working) const;
  void remember(const Working& working);

  size_t size() const { return layout_.sites.size(); }

  DotTrackOptions options_;
  DotLayout layout_;
  std::optional<TagDetector> tag_detector_;
  std::optional<DotPattern> pattern_;
  std::optional<DotPatternIndex> index_;
  std::vector<SiteHistory> history_;
  DotScale scale_;                         ///< of the picture before
  std::vector<TagDetection> tags_before_;  ///< refined ones in the picture before
  int seen_before_ = 0;                    ///< dots in the picture before
  int since_search_ = 0;                   ///< pictures since the whole one was searched
};

DotTracker::Follower::Follower(const MarkerSet& markers, const std::string& file,
                               const DotTrackOptions& options)
    : options_(options), layout_(make_dot_layout(markers.markers, file)), history_(size()) {
  options.validate();
  if (!layout_.corner_sites_by_tag.empty()) {
    std::set<int> anchors;
    for (const auto& [tag, corners] : layout_.corner_sites_by_tag) anchors.insert(tag);
    require_tags(markers.family, anchors, file);
    tag_detector_.emplace(markers.family);
    return;
  }
  if (layout_.columns < 3 || layout_.rows < 3)
    throw InputError(file, "nothing names the dots",
                     "anchor tags among them, or a full grid printed with a pattern of sizes");
  pattern_ = make_dot_pattern(layout_.columns, layout_.rows);
  index_.emplace(*pattern_);
  Eigen::Vector2d low = layout_.sites[0].place_m;
  for (const DotSite& site : layout_.sites) low = low.cwiseMin(site.place_m);
  for (DotSite& site : layout_.sites) {
    const Eigen::Vector2d at = (site.place_m - low) / layout_.spacing_m;
    site.size = dot_radius_over_spacing(pattern_->symbol(static_cast<int>(std::lround(at.y())),
                                                         static_cast<int>(std::lround(at.x())))) /
                dot_radius_over_spacing(0);
  }
}

void DotTracker::Follower::place_tag_corners(Working& working) const {
  std::map<int, int> times;
  for (const TagDetection& tag : working.tags) ++times[tag.id];
  for (const TagDetection& tag : working.tags) {
    const auto corners = layout_.corner_sites_by_tag.find(tag.id);
    if (corners == layout_.corner_sites_by_tag.end() || times[tag.id] > 1) continue;
    for (size_t c = 0; c < 4; ++c)
      working.placed.places[static_cast<size_t>(corners->second[c])] = tag.corner_px[c];
  }
}

/// Finds all dots and tags of the picture, and names them from those that are placed already.
void DotTracker::Follower::search_whole(const cv::Mat& grey, Working& working) {
  std::vector<Dot> good;
  for (const Dot& dot : find_dots(grey, options_.detector))
    if (dot.good()) good.push_back(dot);
  if (tag_detector_) {
    working.tags = tag_detector_->detect(grey);
    place_tag_corners(working);
  } else if (working.placed.count() == 0) {
    name_by_pattern(layout_, *pattern_, *index_, good, working.placed);
  }
  grow_identities(layout_, good, working.placed);
  leave_out_conflicts(layout_, working.placed);
  complete(grey, working);
}

DotTracker::Follower::Working DotTracker::Follower::follow(const cv::Mat& grey) {
  Working working(size());
  for_each_index(size(), [&](size_t site) {
    const SiteHistory& history = history_[site];
    if (!history.last) return;
    DotStart start{.outline = history.last->outline, .blur_px = history.last->blur_px};
    if (history.before_px)
      start.outline.centre_px += history.last->outline.centre_px - *history.before_px;
    centre_on_dark(grey, half_level(*history.last), options_.detector.bright, start.outline);
    const Dot dot = fit_dot(grey, start, options_.detector);
    constexpr double kLargestChange = 1.5;  // of the outline between pictures
    if (dot.good() &&
        shape_ratio(dot.outline.shape_px2, history.last->outline.shape_px2) < kLargestChange)
      working.placed.place(static_cast<int>(site), dot);
  });
  leave_out_conflicts(layout_, working.placed);
  for (size_t site = 0; site < size(); ++site)
    working.followed[site] = working.placed.dots[site].has_value();
  if (tag_detector_) {
    find_tags_nearby(grey, working);
    place_tag_corners(working);
  }
  return working;
}

/// Says where the dots around an anchor expect its corners; nothing where too few tell.
std::optional<PredictedTag> DotTracker::Follower::predicted_anchor(int tag,
                                                                   const SitePlaces& places) const {
  PredictedTag predicted{.id = tag, .close = true};
  for (size_t c = 0; c < 4; ++c) {
    const int corner = layout_.corner_sites_by_tag.at(tag)[c];
    const LocalMap map = fit_local_map(layout_, corner, places, false);
    constexpr double kSure = 0.5, kClose = 0.1;  // spacings
    if (map.neighbours < 3 || map.sigma >= kSure) return std::nullopt;
    predicted.close = predicted.close && map.sigma < kClose;
    predicted.corner_px[c] = map.place_px;
  }
  const auto before = std::ranges::find(tags_before_, tag, &TagDetection::id);
  if (before != tags_before_.end()) {
    predicted.lens_px = before->lens_px;
    predicted.motion_px = before->motion_px;
  }
  return predicted;
}

/// Reads each anchor around the place where the dots expect it: those that are seen whole right
/// there, others by a search of a window.
void DotTracker::Follower::find_tags_nearby(const cv::Mat& grey, Working& working) {
  std::vector<PredictedTag> predicted;
  std::vector<int> ids;
  for (const auto& [tag, corners] : layout_.corner_sites_by_tag) {
    ids.push_back(tag);
    if (const auto anchor = predicted_anchor(tag, working.placed.places))
      predicted.push_back(*anchor);
  }
  std::vector<PredictedTag> known;
  // Edge on, the corners of what is read at a predicted place are often off by half a pixel.
  constexpr double kThinnest_px = 8;
  for (const PredictedTag& anchor : predicted)
    if (anchor.lens_px && thickness_px(anchor.corner_px) > kThinnest_px) known.push_back(anchor);
  constexpr double kWhole = 0.8;  // share of its pixels that are explained
  for (const TagDetection& tag : tag_detector_->read_predicted(grey, known, ids))
    if (tag.refined && tag.explained > kWhole) working.tags.push_back(tag);
  for (const PredictedTag& anchor : predicted)
    if (std::ranges::find(working.tags, anchor.id, &TagDetection::id) == working.tags.end())
      search_around(grey, anchor, working.tags);
}

/// Searches a window around an anchor.
void DotTracker::Follower::search_around(const cv::Mat& grey, const PredictedTag& anchor,
                                         std::vector<TagDetection>& tags) {
  Eigen::Vector2d low = anchor.corner_px[0], high = low;
  for (const Eigen::Vector2d& corner : anchor.corner_px) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const double margin = 0.4 * (high - low).maxCoeff() + 3;
  const cv::Rect window =
      cv::Rect(cv::Point(static_cast<int>(low.x() - margin), static_cast<int>(low.y() - margin)),
               cv::Point(static_cast<int>(high.x() + margin) + 1,
                         static_cast<int>(high.y() + margin) + 1)) &
      cv::Rect(0, 0, grey.cols, grey.rows);
  constexpr int kFewest = 12;  // px; no tag is read in less
  if (window.width < kFewest || window.height < kFewest) return;
  for (TagDetection found : tag_detector_->detect(grey(window))) {
    for (Eigen::Vector2d& corner : found.corner_px) corner += Eigen::Vector2d(window.x, window.y);
    if (found.id == anchor.id) tags.push_back(found);
  }
}

/// Says whether every tag that was read lies where the dots around it expect it.
bool DotTracker::Follower::tags_agree(const Working& working) const {
  PlacedDots without_tags = working.placed;
  for (const auto& [tag, corners] : layout_.corner_sites_by_tag)
    for (const int corner : corners) without_tags.places[static_cast<size_t>(corner)].reset();
  for (const TagDetection& tag : working.tags) {
    const auto corners = layout_.corner_sites_by_tag.find(tag.id);
    if (corners == layout_.corner_sites_by_tag.end()) continue;
    for (size_t c = 0; c < 4; ++c) {
      const LocalMap map = fit_local_map(layout_, corners->second[c], without_tags.places, false);
      constexpr double kSure = 0.15, kAside = 0.4;  // spacings
      if (map.neighbours < 3 || map.sigma > kSure) continue;
      if ((map.place_px - tag.corner_px[c]).norm() > kAside * map.scale_px) return false;
    }
  }
  return true;
}

/// Says for each dot whether it has the size that the pattern gives it.
std::vector<bool> DotTracker::Follower::sites_of_their_size(const Working& working) const {
  std::vector<bool> right(size(), false);
  const double scale = working.scale.radius.value_or(0);
  for (size_t site = 0; site < size(); ++site) {
    if (!working.placed.dots[site]) continue;
    const LocalMap& map = working.maps[site];
    const double area = std::abs(map.jacobian_px.determinant());
    const double size =
        std::sqrt(working.placed.dots[site]->outline.area_px2() / (M_PI * area)) / scale;
    const double off = std::abs(std::log(size / layout_.sites[site].size));
    right[site] = off < 0.5 * std::log(dot_radius_over_spacing(1) / dot_radius_over_spacing(0));
  }
  return right;
}

/// Says whether nearly all dots have the sizes that the pattern gives them.
bool DotTracker::Follower::pattern_agrees(Working& working) const {
  working.scale = measure(working);
  const std::vector<bool> right = sites_of_their_size(working);
  return std::ranges::count(right, true) * 5 > working.placed.count() * 4;
}

/// Seeks unplaced dots where their neighbours expect them, from the placed ones outwards.
void DotTracker::Follower::complete(const cv::Mat& grey, Working& working) const {
  working.scale = scale_.radius ? scale_ : measure(working);
  if (!working.scale.radius) return;
  std::vector<double> blurs;
  for (const std::optional<Dot>& dot : working.placed.dots)
    if (dot) blurs.push_back(dot->blur_px);
  if (blurs.empty()) return;  // nothing is placed from which to go on
  const double blur_px = median(std::move(blurs));
  constexpr int kMostRounds = 40;
  for (int round = 0; round < kMostRounds; ++round)
    if (complete_once(grey, working, blur_px) == 0) return;
}

int DotTracker::Follower::complete_once(const cv::Mat& grey, Working& working,
                                        double blur_px) const {
  std::vector<std::optional<Dot>> found(size());
  for_each_index(size(), [&](size_t site) {
    const DotSite& here = layout_.sites[site];
    if (!here.is_dot || working.placed.places[site] || working.reason[site]) return;
    const LocalMap map =
        fit_local_map(layout_, static_cast<int>(site), working.placed.places, false);
    constexpr double kSure = 0.45;
    if (map.neighbours < 3 || map.sigma > kSure) return;
    DotStart start{
        .outline = {.centre_px = map.place_px,
                    .shape_px2 = expected_shape_px2(map, *working.scale.radius * here.size)},
        .blur_px = blur_px};
    start.outline.shape_px2.diagonal().array() += 0.25;
    for (const int other : here.neighbours)
      if (working.placed.dots[static_cast<size_t>(other)]) {
        centre_on_dark(grey, half_level(*working.placed.dots[static_cast<size_t>(other)]),
                       options_.detector.bright, start.outline);
        break;
      }
    const Dot dot = fit_dot(grey, start, options_.detector);
    if (dot.good() && agrees(map, dot, working.scale, here.size) &&
        has_links(layout_, working.placed, working.scale, static_cast<int>(site), dot))
      found[site] = dot;
    else
      working.attempt[site] = Attempt{.map = map, .dot = dot};
  });
  int placed = 0;
  for (size_t site = 0; site < size(); ++site) {
    if (!found[site]) continue;
    working.placed.place(static_cast<int>(site), *found[site]);
    ++placed;
  }
  if (placed == 0) return 0;
  for (const int site : leave_out_conflicts(layout_, working.placed)) {
    // It is not sought again in this picture.
    working.reason[static_cast<size_t>(site)] = dot_missing::kCovered;
    --placed;
  }
  return std::max(placed, 0);
}

/// Surveys the placed dots and returns the scale of their size.
DotScale DotTracker::Follower::measure(Working& working) const {
  working.maps = survey(layout_, working.placed);
  return measure_dot_scale(layout_, working.placed, working.maps);
}

/// Says for each dot whether something but its neighbours names it: a tag beside it, its size in
/// the pattern, or the picture before.
std::vector<bool> DotTracker::Follower::anchored_sites(const Working& working) const {
  std::vector<bool> anchored = tag_detector_
                                   ? linked_with_tags(layout_, working.placed, working.scale)
                                   : sites_of_their_size(working);
  if (tag_detector_)
    for (size_t site = 0; site < size(); ++site)
      anchored[site] = anchored[site] || working.followed[site];
  return anchored;
}

/// Leaves out groups of dots that are linked with nothing that names them, as those beyond a fold.
/// What their neighbours across the fold expect of them is a guess.
void DotTracker::Follower::leave_out_unanchored(Working& working) const {
  if (!working.scale.radius) return;
  std::vector<int> doubtful;
  const std::vector<bool> right =
      pattern_ ? sites_of_their_size(working) : std::vector<bool>(size(), true);
  for (size_t site = 0; site < size(); ++site)
    if (working.placed.dots[site] &&
        (!right[site] || !has_links(layout_, working.placed, working.scale, static_cast<int>(site),
                                    *working.placed.dots[site])))
      doubtful.push_back(static_cast<int>(site));
  for (const int site : doubtful) {
    working.placed.remove(site);
    working.reason[static_cast<size_t>(site)] = dot_missing::kHidden;
  }
  const std::vector<int> group = linked_groups(layout_, working.placed, working.scale);
  const std::vector<bool> anchored = anchored_sites(working);
  std::map<int, std::pair<int, int>> count;  // of dots, and of anchored ones
  for (size_t site = 0; site < size(); ++site) {
    if (group[site] < 0) continue;
    ++count[group[site]].first;
    count[group[site]].second += anchored[site] ? 1 : 0;
  }
  for (size_t site = 0; site < size(); ++site) {
    if (group[site] < 0) continue;
    const auto [dots, anchors] = count[group[site]];
    // In a pattern three of four dots misplaced have another size; some sizes are misread.
    const bool named = tag_detector_ ? anchors > 0 : dots >= 4 && 4 * anchors >= 3 * dots;
    if (named) continue;
    doubtful.push_back(static_cast<int>(site));
    working.placed.remove(static_cast<int>(site));
    working.reason[site] = dot_missing::kUnplaced;
  }
  // What was left out must not bend the maps that the others are corrected by.
  if (!doubtful.empty()) working.scale = measure(working);
}

/// Leaves out dots that are seen in part: their pixels, or their outline, do not fit.
void DotTracker::Follower::leave_out_cut(Working& working) const {
  constexpr double kCleanMisfit = 0.012, kCleanWaves_px = 0.025;  // what sharp pictures have
  const double misfit = usual(working.placed, kCleanMisfit, excess_misfit);
  const double waves_px =
      usual(working.placed, kCleanWaves_px, [](const Dot& dot) { return dot.waves_px; });
  std::vector<size_t> cut;
  for (size_t site = 0; site < size(); ++site) {
    const std::optional<Dot>& dot = working.placed.dots[site];
    if (!dot) continue;
    const LocalMap& map = working.maps[site];
    Eigen::Matrix2d expected =
        expected_shape_px2(map, working.scale.radius.value_or(0) * layout_.sites[site].size);
    Eigen::Matrix2d shape = dot->outline.shape_px2;
    const double thick = 0.25 * dot->blur_px * dot->blur_px;
    expected.diagonal().array() += thick;
    shape.diagonal().array() += thick;
    const bool odd_shape =
        working.scale.radius && shape_ratio(shape, expected) > options_.cut_shape_ratio;
    // A bend makes waves about as large as its shift of the centre.
    const double bend_px =
        dot_bend_shift_px(map, working.scale.radius.value_or(0) * layout_.sites[site].size).norm();
    const bool odd_pixels = excess_misfit(*dot) > 1.5 * options_.cut_ratio * misfit ||
                            dot->waves_px > options_.cut_ratio * waves_px + 0.7 * bend_px;
    if (odd_shape || odd_pixels) cut.push_back(site);
  }
  for (const size_t site : cut) {
    working.placed.remove(static_cast<int>(site));
    working.reason[site] = dot_missing::kCut;
  }
}

const char* DotTracker::Follower::why_missing(const cv::Mat& grey, const Working& working,
                                              size_t site) const {
  LocalMap map = fit_local_map(layout_, static_cast<int>(site), working.placed.places, false);
  constexpr double kSure = 0.45;
  if (map.neighbours < 3 || map.sigma > kSure) return dot_missing::kUnplaced;
  const Eigen::Vector2d& at = map.place_px;
  const DotSite& here = layout_.sites[site];
  const double radius_px = working.scale.radius.value_or(0) * here.size * map.scale_px;
  if (at.x() < radius_px || at.y() < radius_px || at.x() > grey.cols - 1 - radius_px ||
      at.y() > grey.rows - 1 - radius_px)
    return dot_missing::kOutside;
  constexpr double kEdgeOn = 0.15;  // of the area seen head on
  const double area = map.jacobian_px.determinant() / (map.scale_px * map.scale_px);
  if (std::abs(area) < kEdgeOn || (area < 0) != working.mirrored) return dot_missing::kHidden;
  for (size_t other = 0; other < size(); ++other) {
    if (other == site || !working.placed.dots[other]) continue;
    // Cloth that is known to be elsewhere appears in its place.
    const double apart = (*working.placed.places[other] - at).norm();
    const double on_cloth = (layout_.sites[other].place_m - here.place_m).norm();
    if (apart < 0.7 * std::sqrt(std::abs(area)) * map.scale_px &&
        on_cloth > 1.6 * layout_.spacing_m)
      return dot_missing::kHidden;
  }
  if (!working.attempt[site]) return dot_missing::kCovered;
  const Dot& dot = working.attempt[site]->dot;
  constexpr double kDarkPaper = 20;  // grey levels
  switch (dot.doubt) {
    case DotDoubt::border:
      return dot_missing::kOutside;
    case DotDoubt::blurred:
      return dot_missing::kBlurred;
    case DotDoubt::faint:
      return dot.paper_levels < kDarkPaper ? dot_missing::kDark : dot_missing::kCovered;
    case DotDoubt::not_a_disc:
    case DotDoubt::none:
      return dot_missing::kCut;
    case DotDoubt::unsettled:
      break;
  }
  return dot_missing::kCovered;
}

void DotTracker::Follower::say_why_missing(const cv::Mat& grey, Working& working) const {
  double turn = 0;
  for (size_t site = 0; site < size(); ++site) {
    if (!working.placed.dots[site]) continue;
    const LocalMap& map = working.maps[site];
    if (map.neighbours >= 3) turn += map.jacobian_px.determinant() > 0 ? 1 : -1;
  }
  working.mirrored = turn < 0;
  for (size_t site = 0; site < size(); ++site)
    if (layout_.sites[site].is_dot && !working.placed.dots[site] && !working.reason[site])
      working.reason[site] = why_missing(grey, working, site);
}

DotFrame DotTracker::Follower::report(const Working& working) const {
  DotFrame frame;
  frame.tags = working.tags;
  std::vector<const Dot*> placed;
  for (const std::optional<Dot>& dot : working.placed.dots)
    if (dot) placed.push_back(&*dot);
  const double sigma_factor = std::sqrt(covariance_factor(placed));
  for (size_t site = 0; site < size(); ++site) {
    const DotSite& here = layout_.sites[site];
    if (!here.is_dot) continue;
    if (!working.placed.dots[site]) {
      frame.missing.emplace_back(here.marker, working.reason[site]);
      continue;
    }
    const Dot& dot = *working.placed.dots[site];
    DotRow row{.marker = here.marker,
               .pixel_px = dot.outline.centre_px,
               .sigma_px = sigma_factor * dot.sigma_px()};
    const LocalMap& map = working.maps[site];
    if (map.neighbours >= 4 && working.scale.radius) {
      const Eigen::Vector2d shift = dot_bend_shift_px(map, *working.scale.radius * here.size);
      row.pixel_px -= shift;
      constexpr double kLeftOut = 0.3;  // of the shift: higher orders
      row.sigma_px = std::hypot(row.sigma_px, kLeftOut * shift.norm() * M_SQRT1_2);
    }
    frame.dots.push_back(row);
  }
  return frame;
}

void DotTracker::Follower::remember(const Working& working) {
  seen_before_ = working.placed.count();
  scale_ = working.scale;
  tags_before_.clear();
  std::ranges::copy_if(working.tags, std::back_inserter(tags_before_), &TagDetection::refined);
  for (size_t site = 0; site < size(); ++site) {
    SiteHistory& history = history_[site];
    std::optional<Eigen::Vector2d> before;
    if (history.last) before = history.last->outline.centre_px;
    history.before_px = before;
    history.last = working.placed.dots[site];
  }
}

/// Says whether the whole picture should be searched for cloth that came back.
bool DotTracker::Follower::is_search_due(const Working& working) const {
  constexpr int kEvery = 6;         // pictures
  constexpr double kMissing = 0.1;  // share of the dots
  const double dots = static_cast<double>(
      std::ranges::count_if(layout_.sites, [](const DotSite& site) { return site.is_dot; }));
  return since_search_ >= kEvery && working.placed.count() < (1 - kMissing) * dots;
}

DotFrame DotTracker::Follower::next(const cv::Mat& grey) {
  assert(grey.type() == CV_8UC1);
  Working working(size());
  bool search = seen_before_ == 0;
  if (!search) {
    working = follow(grey);
    const bool agrees = !tag_detector_ || tags_agree(working);
    if (agrees) complete(grey, working);
    if (!agrees || (pattern_ && !pattern_agrees(working))) working = Working(size());
    search = 2 * working.placed.count() < seen_before_ || is_search_due(working);
  }
  if (search) search_whole(grey, working);
  // Otherwise `pattern_agrees` measured the same dots.
  if (search || !pattern_) working.scale = measure(working);
  since_search_ = search ? 0 : since_search_ + 1;
  leave_out_unanchored(working);
  leave_out_cut(working);
  say_why_missing(grey, working);
  DotFrame frame = report(working);
  frame.searched_whole = search;
  remember(working);
  return frame;
}

void DotTrackOptions::validate() const {
  detector.validate();
  if (!(cut_ratio > 1)) throw InputError("cut_ratio", fmt::format("{}", cut_ratio), "a ratio, > 1");
  if (!(cut_shape_ratio > 1))
    throw InputError("cut_shape_ratio", fmt::format("{}", cut_shape_ratio), "a ratio, > 1");
}

std::map<std::string, int> DotFrame::missing_counts() const {
  std::map<std::string, int> counts;
  for (const auto& [marker, reason] : missing) ++counts[reason];
  return counts;
}

DotTracker::DotTracker(const MarkerSet& markers, const std::string& file,
                       const DotTrackOptions& options)
    : follower_(std::make_unique<Follower>(markers, file, options)) {}
DotTracker::~DotTracker() = default;
DotTracker::DotTracker(DotTracker&&) noexcept = default;
DotTracker& DotTracker::operator=(DotTracker&&) noexcept = default;

DotFrame DotTracker::next(const cv::Mat& grey) {
  return follower_->next(grey);
}

}  // namespace clothfit
