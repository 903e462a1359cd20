// Times and memory of a long run, in a room of fixed size.
#pragma once

#include <array>
#include <cstddef>
#include <string>

namespace swarmfit::cli {

/// Quantiles of positive numbers to within one percent, however many there are.
class Quantiles {
 public:
  void add(double value) noexcept;
  std::size_t count() const noexcept { return count_; }
  double at(double share) const noexcept;
  double most() const noexcept { return most_; }

 private:
  static constexpr double kLeast = 1e-3, kStep = 0.01;  // the lowest bin, and the logarithm of a bin's width
  std::array<std::size_t, 2400> bins_{};                // up to 7 hours in ms
  std::size_t count_ = 0;
  double most_ = 0;
};

/// Resident memory of this process [MiB], now and at its most; 0 where the system does not say.
double resident_mib();
double peak_resident_mib();

class SteadyState {
 public:
  /// After each frame: what the work on it and its loading took.
  void add(double total_ms, double load_ms);
  void drop(std::size_t frames) noexcept { dropped_ += frames; }
  void skip() noexcept { ++unusable_; }
  /// A few lines for a person.
  std::string report(double seconds) const;

 private:
  Quantiles total_, load_;
  std::size_t frames_ = 0, dropped_ = 0, unusable_ = 0;
  double first_ms_ = 0, early_mib_ = 0;
};

}  // namespace swarmfit::cli
