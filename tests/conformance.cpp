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

std::map<std::pair<std::string, std::string>, double>& errors() {
  static std::map<std::pair<std::string, std::string>, double> all;
  return all;
}

Result<std::unique_ptr<FitnessEvaluator>> make(const Contender& contender) {
  if (contender.backend == "vulkan") return make_vulkan_evaluator(contender.options, "");
  if (contender.backend == "cpu") return make_cpu_evaluator(contender.options);
  return make_reference_evaluator();
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

void note_error(const std::string& contender, const std::string& what, double relative) {
  double& largest = errors()[{contender, what}];
  largest = std::max(largest, relative);
}

void print_summary() {
  for (const auto& [what, error] : errors()) {
    std::printf("largest relative error of a cost: %-16s %-24s %.2e\n", what.first.c_str(), what.second.c_str(), error);
  }
  for (const std::string& what : skipped()) std::printf("SKIPPED: %s\n", what.c_str());
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
  const bool few_pairs = cloud.dimension == 4 && cloud.count() < 16;
  for (std::size_t c = 0; c < checked; ++c) {
    const std::size_t j = checked == 1 ? 0 : c * (count - 1) / (checked - 1);  // the first, the last, and evenly between
    float oracle = -1;
    EXPECT_OK(reference().evaluate({kind, 1, std::span(swarm).subspan(j * width, width)}, loss, {}, {&oracle, 1}));
    if (worst_loss == 0) {
      EXPECT_EQ(found[j], oracle) << "model " << j;
      continue;
    }
    const double error = std::abs(static_cast<double>(found[j]) - static_cast<double>(oracle)) / worst_loss;
    EXPECT_LE(error, few_pairs ? 3 * kCostTolerance : kCostTolerance)
        << "model " << j << " of " << count << ": " << found[j] << ", the reference says " << oracle;
    note_error(GetParam().name, std::string(traits(kind).name) + (few_pairs ? ", few pairs" : ""), error);
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
