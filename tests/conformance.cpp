#include "conformance.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>

#include "kernels/checks.hpp"
#include "kernels/cpu/cpu_kernels.hpp"

namespace swarmfit::kernels::conformance {
namespace {

std::map<std::string, Result<std::unique_ptr<FitnessEvaluator>>>& evaluators() {
  static std::map<std::string, Result<std::unique_ptr<FitnessEvaluator>>> all;
  return all;
}

std::map<std::string, double>& errors() {
  static std::map<std::string, double> all;
  return all;
}

Result<std::unique_ptr<FitnessEvaluator>> make(const Contender& contender) {
  if (contender.backend == "vulkan") return make_vulkan_evaluator(contender.options, "");
  if (contender.backend == "cpu") return make_cpu_evaluator(contender.options);
  return make_reference_evaluator();
}

/// The model that most points of make_cloud follow.
void true_model(ModelKind kind, double middle, double* p) {
  if (kind == ModelKind::line2d) {
    p[0] = 0.6;
    p[1] = 0.8;
    p[2] = -(0.6 + 0.8) * middle;
  } else {
    p[0] = 2.0 / 7;
    p[1] = 3.0 / 7;
    p[2] = 6.0 / 7;
    p[3] = -(p[0] + p[1] + p[2]) * middle;
  }
}

}  // namespace

std::vector<Contender> contenders(std::string_view backend) {
  std::vector<Contender> all{{"reference", "reference", {}}};
  for (const cpu::CpuKernels* kernels : cpu::available_kernels()) {
    Contender contender{std::string("cpu_") + kernels->name, "cpu", {}};
    std::replace_if(
        contender.name.begin(), contender.name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
    contender.options.simd = kernels->name;
    all.push_back(contender);
  }
  Contender vulkan{"vulkan", "vulkan", {}};
  vulkan.options.validation = true;
  vulkan.options.on_validation = [](std::string_view message) { validation_messages().emplace_back(message); };
  all.push_back(vulkan);
  vulkan.name = "vulkan_gpu_paths";  // what a GPU runs, on whatever device there is
  vulkan.options.gpu_paths = true;
  all.push_back(vulkan);
  if (!backend.empty()) std::erase_if(all, [&](const Contender& contender) { return contender.backend != backend; });
  return all;
}

Result<FitnessEvaluator*> shared_evaluator(const Contender& contender) {
  auto found = evaluators().find(contender.name);
  if (found == evaluators().end()) found = evaluators().emplace(contender.name, make(contender)).first;
  if (!found->second) return tl::unexpected(found->second.error());
  return found->second->get();
}

void release_evaluators() { evaluators().clear(); }

std::vector<std::string>& validation_messages() {
  static std::vector<std::string> all;
  return all;
}

std::set<std::string>& required_backends() {
  static std::set<std::string> all;
  return all;
}

std::set<std::string>& skipped() {
  static std::set<std::string> all;
  return all;
}

void note_error(const std::string& contender, double relative) { errors()[contender] = std::max(errors()[contender], relative); }

void print_summary() {
  for (const auto& [contender, error] : errors()) {
    std::printf("largest relative error of a cost: %-16s %.2e (tolerance %.0e)\n", contender.c_str(), error, kCostTolerance);
  }
  for (const std::string& what : skipped()) std::printf("SKIPPED: %s\n", what.c_str());
}

PointsView Cloud::view() const {
  const auto columns = static_cast<std::size_t>(dimension);
  if (!narrow.empty()) return {narrow.data(), Scalar::float32, dimension, count(), columns * sizeof(float)};
  return {wide.data(), Scalar::float64, dimension, count(), columns * sizeof(double)};
}

double Cloud::worst_loss(Loss loss) const {
  double sum = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    const double cap = caps[i];
    if (view().finite(i)) sum += loss == Loss::truncated_l1 ? cap : cap * cap;
  }
  return sum;
}

double Cloud::radius() const {
  const Extent extent = measure(view());
  double radius = 0;
  for (std::size_t i = 0; i < count(); ++i) {
    for (int d = 0; extent.finite[i] && d < dimension; ++d) radius = std::max(radius, std::abs(view().at(i, d) - extent.centre[d]));
  }
  return radius;
}

double Random::operator()() {  // splitmix64
  std::uint64_t z = state_ += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

Cloud make_cloud(ModelKind kind, std::size_t count, double middle, double size, bool float32) {
  Random random(count + 17);
  double model[kMaxParameters] = {};
  true_model(kind, middle, model);
  Cloud cloud;
  cloud.dimension = traits(kind).dimension;
  for (std::size_t i = 0; i < count; ++i) {
    double x[kMaxDimension];
    double distance = model[traits(kind).parameter_count - 1];
    for (int d = 0; d < cloud.dimension; ++d) {
      x[d] = middle + random.between(-size, size);
      distance += model[d] * x[d];
    }
    const bool inlier = random() < 0.6;
    const double off = random.between(-0.004, 0.004) * size;
    for (int d = 0; d < cloud.dimension; ++d) {
      if (inlier) x[d] -= model[d] * (distance - off);
      if (float32) {
        cloud.narrow.push_back(static_cast<float>(x[d]));
      } else {
        cloud.wide.push_back(x[d]);
      }
    }
    cloud.caps.push_back(static_cast<float>(random.between(0.005, 0.02) * size));
  }
  return cloud;
}

std::vector<double> make_swarm(ModelKind kind, std::size_t count, double middle, double size) {
  Random random(count + 99);
  const int width = traits(kind).parameter_count;
  std::vector<double> swarm;
  for (std::size_t j = 0; j < count; ++j) {
    double p[kMaxParameters] = {};
    true_model(kind, middle, p);
    const double spread = j % 2 == 0 ? 0.01 : 2.0;
    double norm = 0;
    double at_middle = 0;
    for (int d = 0; d + 1 < width; ++d) norm += std::pow(p[d] += random.between(-spread, spread), 2);
    for (int d = 0; d + 1 < width; ++d) at_middle += (p[d] /= std::sqrt(norm)) * middle;
    p[width - 1] = -at_middle + random.between(-spread, spread) * size / 2;
    swarm.insert(swarm.end(), p, p + width);
  }
  return swarm;
}

void Conformance::SetUp() {
  validation_messages().clear();
  auto shared = shared_evaluator(GetParam());
  if (!shared) {
    const std::string what = GetParam().name + ": " + shared.error().message;
    if (required_backends().count(GetParam().backend) > 0) FAIL() << "required, but " << what;
    skipped().insert(what);
    GTEST_SKIP() << what;
  }
  evaluator_ = *shared;
  reference_ = std::move(*make_reference_evaluator());
}

void Conformance::TearDown() {
  for (const std::string& message : validation_messages()) ADD_FAILURE() << "validation: " << message;
  validation_messages().clear();
}

void Conformance::load(const Cloud& cloud) {
  for (FitnessEvaluator* each : {evaluator_, reference_.get()}) {
    ASSERT_OK(each->set_points(cloud.view()));
    ASSERT_OK(each->set_caps(cloud.caps));
  }
}

std::vector<float> Conformance::costs(ModelKind kind, const std::vector<double>& swarm, Loss loss, std::span<const float> cutoffs) {
  const std::size_t count = swarm.size() / static_cast<std::size_t>(traits(kind).parameter_count);
  Guarded<float> costs(count, -1.0F);
  EXPECT_OK(evaluator().evaluate({kind, count, swarm}, loss, cutoffs, costs.span()));
  EXPECT_TRUE(costs.intact()) << "written outside costs";
  return {costs.span().begin(), costs.span().end()};
}

std::vector<float> Conformance::expect_costs_agree(const Cloud& cloud, ModelKind kind, const std::vector<double>& swarm, Loss loss,
                                                   std::size_t models) {
  const auto width = static_cast<std::size_t>(traits(kind).parameter_count);
  const std::size_t count = swarm.size() / width;
  const std::vector<float> found = costs(kind, swarm, loss);
  const double worst_loss = cloud.worst_loss(loss);
  const std::size_t checked = std::min(models, count);
  for (std::size_t c = 0; c < checked; ++c) {
    const std::size_t j = checked == 1 ? 0 : c * (count - 1) / (checked - 1);  // the first, the last, and evenly between
    float oracle = -1;
    EXPECT_OK(reference().evaluate({kind, 1, std::span(swarm).subspan(j * width, width)}, loss, {}, {&oracle, 1}));
    if (worst_loss == 0) {
      EXPECT_EQ(found[j], oracle) << "model " << j;
      continue;
    }
    const double error = std::abs(static_cast<double>(found[j]) - static_cast<double>(oracle)) / worst_loss;
    EXPECT_LE(error, kCostTolerance) << "model " << j << " of " << count << ": " << found[j] << ", the reference says " << oracle;
    note_error(GetParam().name, error);
  }
  return found;
}

std::string contender_name(const testing::TestParamInfo<Contender>& info) { return info.param.name; }

testing::AssertionResult is_invalid(const Result<>& result, std::initializer_list<std::string_view> words) {
  if (result) return testing::AssertionFailure() << "it was accepted";
  if (result.error().kind != Failure::Kind::invalid) return testing::AssertionFailure() << "not `invalid`: " << result.error().message;
  for (const std::string_view word : words) {
    if (result.error().message.find(word) == std::string::npos) {
      return testing::AssertionFailure() << "no '" << word << "' in: " << result.error().message;
    }
  }
  return testing::AssertionSuccess();
}

}  // namespace swarmfit::kernels::conformance
