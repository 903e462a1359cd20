// What the conformance tests share: the back ends under test, clouds and swarms to put to them, and the oracle's answers.
// A new back end is done when it is listed in conformance.cpp and all of this passes.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/evaluators.hpp"

namespace swarmfit::kernels::conformance {

/// One back end as it is tested: a name fit for a test's name, and how to make it.
struct Contender {
  std::string name;     ///< "reference", "cpu_AVX2", "vulkan"
  std::string backend;  ///< as make_evaluator takes it
  EvaluatorOptions options;
};
/// Those of one back end, or all.
std::vector<Contender> contenders(std::string_view backend = {});
inline void PrintTo(const Contender& contender, std::ostream* out) { *out << contender.name; }

/// The process's one evaluator of a contender, made when first asked for; its error stays an error.
Result<FitnessEvaluator*> shared_evaluator(const Contender& contender);
/// Destroys the shared evaluators, so that what validation says of their end is heard too.
void release_evaluators();

/// What Vulkan's validation has said so far.
std::vector<std::string>& validation_messages();

/// Back ends whose absence is a failure (--require-backend), and what was skipped.
std::set<std::string>& required_backends();
std::set<std::string>& skipped();
/// Largest |cost - reference| / cost of a model that explains nothing, by contender and what was evaluated.
void note_error(const std::string& contender, const std::string& what, double relative);
void print_summary();

/// A cloud with its caps, packed rows of doubles or floats.
struct Cloud {
  int dimension = 3;
  std::vector<double> wide;
  std::vector<float> narrow;  ///< used if not empty
  std::vector<float> caps;

  std::size_t count() const { return caps.size(); }
  PointsView view() const;
  double worst_loss(Loss loss) const;  ///< cost of a model that explains nothing
  double radius() const;               ///< of the finite points, about their bounding box's middle
};

/// Deterministic numbers in [0, 1), the same on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {}
  double operator()();
  double between(double low, double high) { return low + (high - low) * (*this)(); }

 private:
  std::uint64_t state_;
};

/// Points for `kind`: six in ten close to one model, the others anywhere within `size` of `middle`; caps around a hundredth of `size`.
Cloud make_cloud(ModelKind kind, std::size_t count, double middle = 3, double size = 2, bool float32 = true);
/// How many points a test of all sizes takes: around every vector, tile and chunk; a few of each for the kinds whose residuals are dear.
std::vector<std::size_t> sizes(ModelKind kind);
/// Models through the cloud: half near the one its points follow, half anywhere. Parameters row after row.
std::vector<double> make_swarm(ModelKind kind, std::size_t count, double middle = 3, double size = 2);

/// A span with guards before and behind, which must still be there at the end.
template <class T>
class Guarded {
 public:
  explicit Guarded(std::size_t count, T fill = T(77)) : count_(count), cells_(count + 2 * kGuard, kSentinel) {
    std::fill(cells_.begin() + kGuard, cells_.begin() + kGuard + static_cast<std::ptrdiff_t>(count), fill);
  }
  std::span<T> span() { return {cells_.data() + kGuard, count_}; }
  T operator[](std::size_t i) const { return cells_[kGuard + i]; }
  bool intact() const {
    for (std::size_t i = 0; i < kGuard; ++i) {
      if (cells_[i] != kSentinel || cells_[kGuard + count_ + i] != kSentinel) return false;
    }
    return true;
  }

 private:
  static constexpr std::size_t kGuard = 64;
  static constexpr T kSentinel = T(12345);
  std::size_t count_;
  std::vector<T> cells_;
};

/// Each test runs once a contender. A contender that is not there skips the test, or fails it where it is required.
class Conformance : public testing::TestWithParam<Contender> {
 protected:
  void SetUp() override;
  void TearDown() override;

  FitnessEvaluator& evaluator() { return *evaluator_; }
  FitnessEvaluator& reference() { return *reference_; }
  /// Puts a cloud to the contender and the oracle.
  void load(const Cloud& cloud);
  /// Costs from the contender, every one checked for its guards; `models` of them compared with the oracle.
  std::vector<float> expect_costs_agree(const Cloud& cloud, ModelKind kind, const std::vector<double>& swarm, Loss loss,
                                        std::size_t models = 16);
  std::vector<float> costs(ModelKind kind, const std::vector<double>& swarm, Loss loss, std::span<const float> cutoffs = {});

 private:
  FitnessEvaluator* evaluator_ = nullptr;
  std::unique_ptr<FitnessEvaluator> reference_;
};

std::string contender_name(const testing::TestParamInfo<Contender>& info);

#define EXPECT_OK(expression) \
  if (const auto& ok_ = (expression); !ok_) ADD_FAILURE() << #expression << ": " << ok_.error().message
#define ASSERT_OK(expression) \
  if (const auto& ok_ = (expression); !ok_) FAIL() << #expression << ": " << ok_.error().message

/// An `invalid` failure whose message names all of `words`: the field, the value, the bound.
testing::AssertionResult is_invalid(const Result<>& result, std::initializer_list<std::string_view> words);

}  // namespace swarmfit::kernels::conformance
