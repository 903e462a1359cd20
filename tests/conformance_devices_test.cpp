// What a back end promises beyond the seam: threads that change nothing, small storage ranges, the pipeline cache, validation.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "conformance.hpp"
#include "tests/io_files.hpp"

namespace swarmfit::kernels::conformance {
namespace {

class Devices : public Conformance {
 protected:
  /// A second evaluator, with other options.
  std::unique_ptr<FitnessEvaluator> make(const EvaluatorOptions& options) {
    auto made = GetParam().backend == "cpu" ? make_cpu_evaluator(options) : make_vulkan_evaluator(options, "");
    if (made) return std::move(*made);
    ADD_FAILURE() << made.error().message;
    return nullptr;
  }

  std::vector<float> costs_of(FitnessEvaluator& one, const Cloud& cloud, ModelKind kind, const std::vector<double>& swarm) {
    EXPECT_OK(one.set_points(cloud.view()));
    EXPECT_OK(one.set_caps(cloud.caps));
    Guarded<float> out(swarm.size() / static_cast<std::size_t>(traits(kind).parameter_count));
    EXPECT_OK(one.evaluate({kind, out.span().size(), swarm}, Loss::truncated_l1, {}, out.span()));
    EXPECT_TRUE(out.intact());
    return {out.span().begin(), out.span().end()};
  }
};
class CpuDevices : public Devices {};
class VulkanDevices : public Devices {};
INSTANTIATE_TEST_SUITE_P(Conformance, CpuDevices, testing::ValuesIn(contenders("cpu")), contender_name);
INSTANTIATE_TEST_SUITE_P(Conformance, VulkanDevices, testing::ValuesIn(contenders("vulkan")), contender_name);

TEST_P(CpuDevices, ThreadsChangeNothing) {
  const Cloud cloud = make_cloud(ModelKind::plane, 200001);
  const std::vector<double> swarm = make_swarm(ModelKind::plane, 65);
  EvaluatorOptions options = GetParam().options;
  std::vector<float> first;
  for (const int threads : {1, 2, 3}) {
    options.threads = threads;
    const auto one = make(options);
    ASSERT_TRUE(one);
    const std::vector<float> found = costs_of(*one, cloud, ModelKind::plane, swarm);
    if (first.empty()) first = found;
    EXPECT_EQ(found, first) << threads << " threads";
  }
}

/// Half of a swarm about one model, half anywhere: some chunks are beyond all of it, others are not.
TEST_P(VulkanDevices, PruningChangesNoCost) {
  EvaluatorOptions options = GetParam().options;
  const auto pruned = make(options);
  options.pruning = false;
  const auto all = make(options);
  options.pruning = true;
  options.max_storage_range = 200000;
  const auto split = make(options);
  ASSERT_TRUE(pruned && all && split);
  for (const ModelKind kind : kModelKinds) {
    SCOPED_TRACE(traits(kind).name);
    Cloud cloud = make_cloud(kind, 30001);
    cloud.narrow[9] = std::numeric_limits<float>::quiet_NaN();
    std::fill(cloud.caps.begin() + 2000, cloud.caps.begin() + 9000, 0.0F);
    const std::vector<double> swarm = make_swarm(kind, 150);
    // In one order for all: what is not pruned need not be sorted.
    PointsView view = cloud.view();
    view.ordered = kind == ModelKind::plane || kind == ModelKind::line2d;
    for (FitnessEvaluator* one : {pruned.get(), all.get(), split.get()}) {
      ASSERT_OK(one->set_points(view));
      ASSERT_OK(one->set_caps(cloud.caps));
    }
    for (const Loss loss : {Loss::truncated_l1, Loss::truncated_l2}) {
      std::vector<float> exact(150), same(150), known(150), parts(150);
      ASSERT_OK(all->evaluate({kind, 150, swarm}, loss, {}, exact));
      ASSERT_OK(pruned->evaluate({kind, 150, swarm}, loss, {}, same));
      std::vector<float> cutoffs = exact;
      for (std::size_t j = 0; j < 150; ++j) cutoffs[j] *= j % 3 == 0 ? 0.3F : j % 3 == 1 ? 1.001F : 1.0F;
      ASSERT_OK(pruned->evaluate({kind, 150, swarm}, loss, cutoffs, known));
      ASSERT_OK(split->evaluate({kind, 150, swarm}, loss, cutoffs, parts));
      const auto worst = static_cast<float>(kCostTolerance * cloud.worst_loss(loss));
      for (std::size_t j = 0; j < 150; ++j) {
        EXPECT_NEAR(same[j], exact[j], view.ordered ? 0 : worst) << j;
        for (const float told : {known[j], parts[j]}) {
          EXPECT_LE(told, exact[j] + worst) << j;
          if (exact[j] + worst < cutoffs[j]) {
            EXPECT_NEAR(told, exact[j], worst) << j;
          } else {
            EXPECT_GE(told, cutoffs[j] - worst) << j;
          }
        }
      }
    }
    const Effort effort = pruned->effort();
    EXPECT_EQ(effort.evaluations, 600U);
    EXPECT_LE(effort.touched, effort.point_models);
    if (traits(kind).bounded && !traits(kind).affine) {
      EXPECT_LT(effort.touched, effort.point_models);
    }
  }
}

/// Tiles of open particles: of several spans, and, where tiles are small, more than one row of an indirect dispatch has.
TEST_P(VulkanDevices, ManyOpenTilesAreAllDone) {
  constexpr std::size_t kModels = 2600;
  EvaluatorOptions options = GetParam().options;
  const auto pruned = make(options);
  options.pruning = false;
  const auto all = make(options);
  ASSERT_TRUE(pruned && all);
  Cloud cloud = make_cloud(ModelKind::cylinder, 60001);
  // Every chunk is near every model.
  std::fill(cloud.caps.begin(), cloud.caps.end(), 50.0F);
  const std::vector<double> swarm = make_swarm(ModelKind::cylinder, kModels);
  PointsView view = cloud.view();
  view.ordered = true;
  std::vector<float> exact(kModels), found(kModels), again(kModels);
  for (FitnessEvaluator* one : {pruned.get(), all.get()}) {
    ASSERT_OK(one->set_points(view));
    ASSERT_OK(one->set_caps(cloud.caps));
  }
  ASSERT_OK(all->evaluate({ModelKind::cylinder, kModels, swarm}, Loss::truncated_l1, {}, exact));
  ASSERT_OK(pruned->evaluate({ModelKind::cylinder, kModels, swarm}, Loss::truncated_l1, {}, found));
  EXPECT_EQ(pruned->effort().touched, pruned->effort().point_models);
  EXPECT_EQ(found, exact);
  // A list that is used again starts from nothing, whatever place a chunk's tiles had before.
  const SwarmView few{ModelKind::cylinder, 300, std::span(swarm).first(300 * swarm.size() / kModels)};
  exact.resize(few.count);
  again.resize(few.count);
  std::fill(cloud.caps.begin(), cloud.caps.end(), 0.01F);
  for (FitnessEvaluator* one : {pruned.get(), all.get()}) ASSERT_OK(one->set_caps(cloud.caps));
  ASSERT_OK(all->evaluate(few, Loss::truncated_l1, {}, exact));
  for (int run = 0; run < 2; ++run) {
    ASSERT_OK(pruned->evaluate(few, Loss::truncated_l1, {}, again));
    EXPECT_EQ(again, exact);
  }
  EXPECT_LT(pruned->effort().touched, pruned->effort().point_models);
}

TEST_P(VulkanDevices, SmallStorageRangesSplitTheCloud) {
  EvaluatorOptions options = GetParam().options;
  for (const std::size_t range : {16384, 50000, 1000000}) {
    SCOPED_TRACE("range " + std::to_string(range));
    options.max_storage_range = range;
    const auto small = make(options);
    ASSERT_TRUE(small);
    for (const ModelKind kind : kModelKinds) {
      if (!traits(kind).affine && range > 16384) continue;  // the smallest splits most
      Cloud cloud = make_cloud(kind, 60001);
      cloud.narrow[7] = std::numeric_limits<float>::quiet_NaN();
      load(cloud);
      const std::vector<double> swarm = make_swarm(kind, traits(kind).affine ? 300 : 50);
      const std::vector<float> whole = costs(kind, swarm, Loss::truncated_l1);
      const std::vector<float> split = costs_of(*small, cloud, kind, swarm);
      double worst = 0;
      for (std::size_t j = 0; j < whole.size(); ++j) worst = std::max(worst, std::abs(static_cast<double>(split[j] - whole[j])));
      EXPECT_LE(worst, kCostTolerance * cloud.worst_loss(Loss::truncated_l1));

      const ModelView model{kind, std::span(swarm).first(static_cast<std::size_t>(traits(kind).parameter_count))};
      std::vector<float> far(cloud.count()), near(cloud.count());
      EXPECT_OK(small->distances(model, far));
      EXPECT_OK(evaluator().distances(model, near));
      near[7 / static_cast<std::size_t>(cloud.dimension)] = far[7 / static_cast<std::size_t>(cloud.dimension)] = 0;  // NaN in both
      EXPECT_EQ(far, near);
      std::vector<std::uint16_t> far_labels(cloud.count()), near_labels(cloud.count());
      EXPECT_OK(small->assign({&model, 1}, cloud.caps, far_labels));
      EXPECT_OK(evaluator().assign({&model, 1}, cloud.caps, near_labels));
      EXPECT_EQ(far_labels, near_labels);
    }
  }
}

TEST_P(VulkanDevices, StorageRangeHasABound) {
  EvaluatorOptions options = GetParam().options;
  options.max_storage_range = 100;
  const auto made = make_vulkan_evaluator(options, "");
  ASSERT_FALSE(made);
  EXPECT_TRUE(is_invalid(tl::unexpected(made.error()), {"max_storage_range", "100", "16384"}));
}

TEST_P(VulkanDevices, UnknownNamesAreErrors) {
  const auto made = make_vulkan_evaluator({}, "no such device");
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, Failure::Kind::unavailable);
  EXPECT_NE(made.error().message.find("no such device"), std::string::npos) << made.error().message;
}

TEST_P(VulkanDevices, ThePipelineCacheIsKeptAndNeverTrusted) {
  namespace fs = std::filesystem;
  const tests::TemporaryFolder outer;
  const fs::path folder = outer / "inner";
  EvaluatorOptions options = GetParam().options;
  options.pipeline_cache = folder;
  const Cloud cloud = make_cloud(ModelKind::plane, 500);
  const std::vector<double> swarm = make_swarm(ModelKind::plane, 5);
  const std::vector<float> expected = costs_of(*make(options), cloud, ModelKind::plane, swarm);

  const auto files = [&] { return std::vector<fs::path>(fs::directory_iterator(folder), fs::directory_iterator()); };
  ASSERT_EQ(files().size(), 1U);  // one file, and no draft beside it
  const fs::path file = files()[0];
  std::ifstream in(file, std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  ASSERT_GT(good.size(), 24U);

  std::string flipped = good;
  flipped[good.size() - 1] = static_cast<char>(flipped[good.size() - 1] ^ 1);
  std::string foreign = good;
  foreign[0] = 'x';
  for (const std::string& bad : {std::string(), good.substr(0, good.size() / 2), flipped, foreign, good + "tail"}) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bad;
    EXPECT_EQ(costs_of(*make(options), cloud, ModelKind::plane, swarm), expected);
    std::ifstream again(file, std::ios::binary);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(again), {}), good) << "not mended";
  }
}

TEST_P(VulkanDevices, MissingValidationIsAnError) {
  const char* given = std::getenv("VK_LAYER_PATH");
  const std::string before = given == nullptr ? "" : given;  // the tests that follow may need it
  setenv("VK_LAYER_PATH", "/nowhere", 1);
  const auto made = make_vulkan_evaluator(GetParam().options, "");
  if (given == nullptr) {
    unsetenv("VK_LAYER_PATH");
  } else {
    setenv("VK_LAYER_PATH", before.c_str(), 1);
  }
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, Failure::Kind::unavailable);
  EXPECT_NE(made.error().message.find("VK_LAYER_KHRONOS_validation"), std::string::npos) << made.error().message;
}

TEST(Backends, UnknownNamesListWhatThereIs) {
  const auto made = make_evaluator("abacus", {});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, Failure::Kind::unavailable);
  for (const char* word : {"abacus", "auto", "cpu", "vulkan", "reference"}) {
    EXPECT_NE(made.error().message.find(word), std::string::npos) << made.error().message;
  }
}

TEST(Backends, AutoNeverTakesSoftwareVulkan) {
  const auto made = make_evaluator("auto", {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_FALSE(made->reason.empty());
  if (made->evaluator->identity().backend != "vulkan") return;
  for (const DeviceDescription& device : list_devices()) {
    if (device.device == made->evaluator->identity().device) {
      EXPECT_NE(device.kind, "software");
    }
  }
}

}  // namespace
}  // namespace swarmfit::kernels::conformance
