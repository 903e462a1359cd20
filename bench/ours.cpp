// Swarmfit through its public interface, a fitter reused from frame to frame.
#include <optional>
#include <stdexcept>

#include <swarmfit/fit.hpp>

#include "bench/contender.hpp"

namespace swarmfit::peers {
namespace {

class Ours final : public Contender {
 public:
  explicit Ours(bool organised) : organised_(organised) {}

  std::string name() const override { return organised_ ? "Swarmfit, grid" : "Swarmfit"; }
  std::string how() const override {
    return organised_ ? "default preset; the whole grid as it is, holes included" : "default preset; the finite points";
  }
  bool organised() const override { return organised_; }

  void take(const Scene& scene, const Task& task) override {
    points_ = organised_ ? scene.grid : scene.points;
    options_.threshold = task.threshold;
    options_.min_inliers = task.min_inliers;
    options_.threads = task.threads;
    options_.backend = "cpu";
    auto made = Fitter::create(options_);
    if (!made) throw std::runtime_error(made.error().message);
    fitter_.emplace(std::move(*made));
  }

  Found run(std::uint64_t seed) override {
    options_.seed = seed;
    if (auto done = fitter_->set_options(options_); !done) throw std::runtime_error(done.error().message);
    auto result = fitter_->fit(PointsView(std::span<const float>(points_), 3));
    if (!result) throw std::runtime_error(result.error().message);
    Found found;
    for (const Model& model : result->models) {
      const Eigen::Vector3d normal = model.normal();
      found.planes.push_back({{normal.x(), normal.y(), normal.z()}, model.offset()});
    }
    found.labels = std::move(result->labels);
    found.evaluations = result->evaluations;
    return found;
  }

 private:
  bool organised_;
  std::vector<float> points_;
  FitOptions options_;
  std::optional<Fitter> fitter_;
};

}  // namespace

SWARMFIT_CONTENDER(make_ours) { return std::make_unique<Ours>(false); }
SWARMFIT_CONTENDER(make_ours_organised) { return std::make_unique<Ours>(true); }

}  // namespace swarmfit::peers
