#include <swarmfit/figures.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "host/common/thrown.hpp"
#include "host/figures/chart.hpp"
#include "host/figures/flight.hpp"
#include "host/figures/line_scene.hpp"
#include "host/io/palette.hpp"

namespace swarmfit {
namespace {

using namespace figures;

constexpr int kMoves = 150;  // the last that the paper's figure 6 shows
const std::string kGrey = "#9ca3af", kBest = "#6e1212", kTruth = "#111827";

std::string hex(const io::Rgb& c) { return fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]); }

/// A line as the paper's parameter plane has it, about the middle of the unit square.
struct Polar {
  double degrees;  ///< of the normal, in [0, 180)
  double offset;   ///< of the line from the middle along the normal, in sides
};

Polar polar(const models::Position& line) {
  const double offset = -(line[2] + 0.5 * line[0] + 0.5 * line[1]);
  const double angle = std::atan2(line[1], line[0]) * 180 / std::numbers::pi;
  if (angle < 0) return {angle + 180, -offset};
  return angle < 180 ? Polar{angle, offset} : Polar{0, -offset};
}

Polar polar(const Segment& s) {
  const Eigen::Vector2d along = (s.b - s.a).normalized(), normal(-along.y(), along.x());
  models::Position line(3);
  line << normal, -normal.dot(s.a);
  return polar(line);
}

Axis angle_axis() { return {"direction of the line's normal [degrees]", {0, 180}, {0, 45, 90, 135, 180}}; }
Axis offset_axis() { return {"offset from the middle [side of the square]", {-0.75, 0.75}, {-0.5, 0, 0.5}}; }
Axis side_axis() { return {"", {0, 1}, {0, 0.5, 1}}; }

/// From the least to the largest of these and a little beyond, with some four ticks.
Axis close_axis(std::string label, const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double span = std::max(*high - *low, 1e-6), unit = std::pow(10, std::floor(std::log10(span / 3)));
  double step = unit;
  for (const double times : {2.0, 5.0, 10.0}) {
    if (span / step > 5) step = times * unit;
  }
  Axis axis{std::move(label), {*low - 0.15 * span, *high + 0.15 * span}, {}};
  for (double k = std::ceil(axis.range.low / step); k * step <= axis.range.high; ++k) axis.ticks.push_back(k * step);
  return axis;
}

void caption(Svg& svg, double y, std::initializer_list<std::string> lines) {
  for (const std::string& words : lines) {
    svg.text({24, y}, words, {.size = 12});
    y += 17;
  }
}

/// Every position of the flight that has a pixel of its own in a chart; where several share one, the fittest.
class Cloud2d {
 public:
  explicit Cloud2d(const Chart& chart) : chart_(chart) {}
  void add(double x, double y, double fitness) {
    ++all_;
    if (chart_.holds(x, y)) dots_.push_back({chart_.at(x, y), fitness});
  }
  /// Fittest last, so that it lies on top.
  void draw(Svg& svg, double worst, double best) {
    std::sort(dots_.begin(), dots_.end(), [](const Dot& a, const Dot& b) { return a.fitness < b.fitness; });
    std::set<std::pair<int, int>> taken;
    std::vector<std::vector<Place>> layers(kLayers);
    for (const Dot& dot : dots_) {
      if (!taken.insert({static_cast<int>(dot.at.x()), static_cast<int>(dot.at.y())}).second) continue;
      const double share = (worst - dot.fitness) / (worst - best);
      const auto layer = std::min(static_cast<std::size_t>(std::max(share, 0.0) * kLayers), kLayers - 1);
      layers[layer].push_back(dot.at);
    }
    for (std::size_t k = 0; k < kLayers; ++k) svg.dots(layers[k], 2.2, shade(static_cast<double>(k) / (kLayers - 1)));
  }
  std::size_t all() const noexcept { return all_; }
  std::size_t within() const noexcept { return dots_.size(); }

 private:
  static constexpr std::size_t kLayers = 16;
  struct Dot {
    Place at;
    double fitness;
  };
  const Chart& chart_;
  std::vector<Dot> dots_;
  std::size_t all_ = 0;
};

Figure flight_figure(const Flight& flight, const LineScene& scene) {
  Svg svg(960, 500);
  const double worst = flight.nothing_explained, best = flight.steps.back().best_fitness;
  Chart plane(svg, {70, 40}, 390, 330, angle_axis(), offset_axis(), "Where the particles flew");
  const double least = std::floor(best * 10 - 0.5) / 10, most = std::ceil(worst * 10 + 0.5) / 10;
  Axis height{"fitness f (3), to be minimised", {least, most}, {}};
  for (double v = std::ceil(least * 2) / 2; v <= most; v += 0.5) height.ticks.push_back(v);
  Chart funnel(svg, {540, 40}, 390, 330, angle_axis(), height, "How fit they were there");
  Cloud2d over(plane), beside(funnel);
  for (const Step& step : flight.steps) {
    for (std::size_t j = 0; j < step.positions.size(); ++j) {
      const Polar p = polar(step.positions[j]);
      over.add(p.degrees, p.offset, step.fitness[j]);
      beside.add(p.degrees, step.fitness[j], step.fitness[j]);
    }
  }
  over.draw(svg, worst, best);
  beside.draw(svg, worst, best);
  const Polar truth = polar(scene.truth.front());
  const Place ring = plane.at(truth.degrees, truth.offset);
  svg.line(ring - Place(9, 0), ring + Place(9, 0), {kTruth, 1, 1, {}});
  svg.line(ring - Place(0, 9), ring + Place(0, 9), {kTruth, 1, 1, {}});
  for (int k = 0; k < 120; ++k) svg.rectangle({540.0 + k, 418}, 1.2, 10, shade(k / 119.0));
  svg.text({534, 427}, "explains nothing", {.size = 11, .anchor = "end"});
  svg.text({666, 427}, "the best found", {.size = 11});
  caption(svg, 454,
          {fmt::format(
               "Fig. 2: all {} positions of {} particles over {} moves, preset paper. Where several share a pixel the fittest is drawn.",
               over.all(), flight.steps.front().positions.size(), flight.steps.size() - 1),
           fmt::format("One line of {} points among {} outliers; the cross marks the truth. {} positions lie beyond the left frame.",
                       kOnLine, kOutliers, over.all() - over.within())});
  return {"fig2-flight.svg", "every position that every particle flew through", std::move(svg).finish()};
}

Figure global_best_figure(const Flight& flight, const LineScene& scene) {
  Svg svg(960, 520);
  const Axis time{"iteration", {0, static_cast<double>(kMoves)}, {0, 50, 100, 150}};
  const Polar truth = polar(scene.truth.front());
  std::vector<double> degrees = {truth.degrees}, sides = {truth.offset}, fitness_values;
  for (const Step& s : flight.steps) {
    degrees.push_back(polar(s.best).degrees);
    sides.push_back(polar(s.best).offset);
    fitness_values.push_back(s.best_fitness);
  }
  const Axis angle = close_axis("normal [degrees]", degrees), offset = close_axis("offset [side]", sides);
  const Axis fitness = close_axis("fitness f", fitness_values);
  Axis quiet = time;
  quiet.label.clear();
  Chart angles(svg, {70, 40}, 390, 170, quiet, angle, "Direction of the global best");
  Chart offsets(svg, {70, 260}, 390, 170, time, offset, "Offset of the global best");
  Chart fitnesses(svg, {540, 40}, 390, 390, time, fitness, "Fitness of the global best");
  std::vector<Place> a, o, f;
  double before = -1;
  std::vector<Place> moved;
  for (std::size_t k = 0; k < flight.steps.size(); ++k) {
    const Polar p = polar(flight.steps[k].best);
    const auto t = static_cast<double>(k);
    const double now = flight.steps[k].best_fitness;
    if (k > 0) f.push_back(fitnesses.at(t, before));
    a.push_back(angles.at(t, p.degrees));
    o.push_back(offsets.at(t, p.offset));
    f.push_back(fitnesses.at(t, now));
    if (now != before) moved.push_back(f.back());
    before = now;
  }
  angles.straight(0, 1, -truth.degrees, {kTruth, 1, 1, "4 3"});
  offsets.straight(0, 1, -truth.offset, {kTruth, 1, 1, "4 3"});
  for (const auto* way : {&a, &o, &f}) svg.polyline(*way, {kBest, 2, 1, {}});
  svg.dots(moved, 5, kBest);
  std::string end = "within these iterations it moved too often for that.";
  if (flight.converged > 0) {
    const auto t = static_cast<double>(flight.converged);
    fitnesses.straight(1, 0, -t, {"#2563eb", 1, 1, "4 3"});
    svg.text(fitnesses.at(t, fitness.range.high) + Place(5, 16), "converged", {.size = 11, .colour = "#2563eb"});
    end = fmt::format("at iteration {} it had stood still for 20, which is what ends a fit's swarm.", flight.converged);
  }
  caption(svg, 482,
          {"Fig. 3: the way of the global best over the iterations, preset paper, the flight of Fig. 2. Dashed: the truth. Dots: it moved;",
           end});
  return {"fig3-global-best.svg", "the way of the global best over the iterations", std::move(svg).finish()};
}

void draw_points(Chart& chart, const LineScene& scene, std::size_t first, std::size_t last, double size, const std::string& colour) {
  std::vector<Place> places;
  for (std::size_t i = first; i < last; ++i) {
    if (chart.holds(scene.points[i].x(), scene.points[i].y())) places.push_back(chart.at(scene.points[i].x(), scene.points[i].y()));
  }
  chart.svg().dots(places, size, colour);
}

Figure iterations_figure(const Flight& flight, const LineScene& scene) {
  Svg svg(960, 720);
  constexpr double kSide = 260;
  const auto panel = [&](int k, const std::string& title) {
    return Chart(svg, {50.0 + 305.0 * (k % 3), 40.0 + 320.0 * (k / 3)}, kSide, kSide, side_axis(), side_axis(), title);
  };
  const std::size_t all = scene.points.size();
  Chart data = panel(0, "data");
  draw_points(data, scene, 0, all, 2, "#374151");
  int k = 1;
  for (const std::size_t moves : {0, 50, 100, 150}) {
    Chart chart = panel(k++, moves == 0 ? "particles as they start" : fmt::format("after {} iterations", moves));
    draw_points(chart, scene, 0, all, 1.6, kGrey);
    const Step& step = flight.steps[moves];
    std::vector<std::size_t> order(step.positions.size());
    for (std::size_t j = 0; j < order.size(); ++j) order[j] = j;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return step.fitness[a] > step.fitness[b]; });
    for (const std::size_t j : order) {
      const models::Position& line = step.positions[j];
      const double share = (flight.nothing_explained - step.fitness[j]) / (flight.nothing_explained - flight.steps.back().best_fitness);
      chart.straight(line[0], line[1], line[2], {shade(share), 0.8, 0.8, {}});
    }
  }
  Chart last = panel(5, "final estimate");
  draw_points(last, scene, kOnLine, all, 1.6, kGrey);
  draw_points(last, scene, 0, kOnLine, 2.4, "#2563eb");
  const models::Position& best = flight.steps.back().best;
  last.straight(best[0], best[1], best[2], {kBest, 2, 1, {}});
  caption(svg, 682,
          {fmt::format("Fig. 6: {} points, {} on a line (noise {} of the side) and {} outliers; {} particles, preset paper, threshold {}.",
                       all, kOnLine, kNoise, kOutliers, flight.steps.front().positions.size(), kThreshold),
           "A particle is a line, the darker the fitter. Blue in the last picture: the points that are on the line in truth."});
  return {"fig6-iterations.svg", "the particles at 0, 50, 100 and 150 iterations and the final estimate", std::move(svg).finish()};
}

bool same(const Segment& truth, const Model& line) {
  const auto off = [&](const Eigen::Vector2d& p) { return std::abs(line.normal().head<2>().dot(p) + line.offset()); };
  return off(truth.a) < kThreshold && off(truth.b) < kThreshold;
}

/// A found line, as far as its points reach.
void draw_found(Chart& chart, const LineScene& scene, const FitResult& result, std::size_t k) {
  const std::string colour = hex(io::plane_colour(k + 1));
  const Model& line = result.models[k];
  const Eigen::Vector2d normal = line.normal().head<2>(), along(-normal.y(), normal.x());
  std::vector<Place> places;
  std::vector<double> reach;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (result.labels[i] != k + 1) continue;
    reach.push_back(along.dot(scene.points[i]));
    if (chart.holds(scene.points[i].x(), scene.points[i].y())) places.push_back(chart.at(scene.points[i].x(), scene.points[i].y()));
  }
  chart.svg().dots(places, 2.8, colour);
  chart.straight(normal.x(), normal.y(), line.offset(), {colour, 1, 0.8, {}});
  if (reach.empty()) return;
  const auto [low, high] = std::minmax_element(reach.begin(), reach.end());
  const Eigen::Vector2d foot = -line.offset() * normal;
  const Eigen::Vector2d label = foot + (0.1 * *low + 0.9 * *high) * along;
  chart.svg().text(chart.at(label.x(), label.y()) + Place(5, -5), fmt::format("{}", k + 1), {.size = 14, .colour = colour, .bold = true});
}

Expected<Figure> several_figure(std::uint64_t seed) {
  using V = Eigen::Vector2d;
  const std::vector<std::pair<std::string, std::vector<Segment>>> scenes = {
      {"three lines", random_segments(3, seed)},
      {"eight lines", random_segments(8, seed + 1)},
      {"four through one point",
       {{V(0.1, 0.5), V(0.9, 0.5)}, {V(0.5, 0.1), V(0.5, 0.9)}, {V(0.2, 0.2), V(0.8, 0.8)}, {V(0.2, 0.8), V(0.8, 0.2)}}},
      {"each ends at another",
       {{V(0.12, 0.15), V(0.88, 0.25)}, {V(0.75, 0.23), V(0.62, 0.9)}, {V(0.66, 0.7), V(0.1, 0.55)}, {V(0.3, 0.6), V(0.38, 0.185)}}},
  };
  FitOptions options;
  options.model = ModelType::line2d;
  options.threshold = kThreshold;
  options.seed = seed;
  options.backend = "cpu";
  Svg svg(960, 1060);
  int panel = 0;
  for (const auto& [name, truth] : scenes) {
    const LineScene scene = make_line_scene(truth, seed + static_cast<std::uint64_t>(panel));
    auto result = fit(scene.view(), options);
    if (!result) return tl::unexpected(result.error());
    std::size_t right = 0, extra = 0;
    for (const Segment& s : truth) {
      if (std::any_of(result->models.begin(), result->models.end(), [&](const Model& m) { return same(s, m); })) ++right;
    }
    for (const Model& m : result->models) {
      if (std::none_of(truth.begin(), truth.end(), [&](const Segment& s) { return same(s, m); })) ++extra;
    }
    Chart chart(svg, {60.0 + 460.0 * (panel % 2), 40.0 + 490.0 * (panel / 2)}, 420, 420, side_axis(), side_axis(),
                fmt::format("{}: {} of {} found, {} more", name, right, truth.size(), extra));
    draw_points(chart, scene, 0, scene.points.size(), 1.6, kGrey);
    for (std::size_t k = 0; k < result->models.size(); ++k) draw_found(chart, scene, *result, k);
    ++panel;
  }
  caption(
      svg, 1016,
      {fmt::format("Fig. 7: {} points a line among {} outliers, preset fast, threshold {}. Colours and numbers are the labels that were "
                   "found, in the order in which they were.",
                   kOnLine, kOutliers, kThreshold),
       "A true line counts as found where a found one passes both its ends within the threshold; grey points got no label."});
  return Figure{"fig7-several-lines.svg", "several lines, crossing and ending at each other, found and labelled", std::move(svg).finish()};
}

}  // namespace

Expected<std::vector<Figure>> paper_figures(std::uint64_t seed) try {
  const LineScene scene = make_line_scene(random_segments(1, seed), seed);
  FitOptions options;
  options.model = ModelType::line2d;
  options.preset = Preset::paper;
  options.threshold = kThreshold;
  options.seed = seed;
  options.backend = "cpu";
  const auto flight = fly(scene.view(), options, kMoves);
  if (!flight) return tl::unexpected(flight.error());
  std::vector<Figure> all = {flight_figure(*flight, scene), global_best_figure(*flight, scene), iterations_figure(*flight, scene)};
  auto several = several_figure(seed);
  if (!several) return tl::unexpected(several.error());
  all.push_back(std::move(*several));
  return all;
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input, [] { return std::string("no memory for the figures"); });
}

}  // namespace swarmfit
