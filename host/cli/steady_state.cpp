#include "host/cli/steady_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <sys/resource.h>
#include <unistd.h>

#include <fmt/format.h>

#include "host/cli/report.hpp"

namespace swarmfit::cli {
namespace {

constexpr std::size_t kEarly = 50;  // memory after this many frames is what the end is held against

}  // namespace

void Quantiles::add(double value) noexcept {
  const double bin = std::log(std::max(value, kLeast) / kLeast) / kStep;
  ++bins_[std::min(bins_.size() - 1, static_cast<std::size_t>(bin))];
  ++count_;
  most_ = std::max(most_, value);
}

double Quantiles::at(double share) const noexcept {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(count_)));
  std::size_t seen = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    seen += bins_[bin];
    if (seen >= std::max<std::size_t>(rank, 1)) return std::min(most_, kLeast * std::exp((static_cast<double>(bin) + 0.5) * kStep));
  }
  return most_;
}

double resident_mib() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  long all = 0, resident = 0;
  const int read = std::fscanf(file, "%ld %ld", &all, &resident);
  std::fclose(file);
  return read == 2 ? static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20) : 0;
}

double peak_resident_mib() {
  rusage usage{};
  return ::getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024 : 0;
}

void SteadyState::add(double total_ms, double load_ms) {
  if (++frames_ == 1) {
    first_ms_ = total_ms;
  } else {
    total_.add(total_ms);
    load_.add(load_ms);
  }
  if (frames_ == kEarly) early_mib_ = resident_mib();
}

std::string SteadyState::report(double seconds) const {
  std::string out = fmt::format("{} in {:.1f} s, {} dropped, {} unusable\n", count(frames_, "frame"), seconds, dropped_, unusable_);
  if (frames_ > 0) out += fmt::format("first frame {:.1f} ms", first_ms_);
  if (total_.count() > 0)
    out += fmt::format("; each after it p50 {:.1f} ms, p99 {:.1f} ms, worst {:.1f} ms (loading p50 {:.1f} ms, p99 {:.1f} ms)",
                       total_.at(0.5), total_.at(0.99), total_.most(), load_.at(0.5), load_.at(0.99));
  if (frames_ > 0) out += "\n";
  out += "memory";
  if (early_mib_ > 0) out += fmt::format(" {:.0f} MiB after {} frames,", early_mib_, kEarly);
  return out + fmt::format(" {:.0f} MiB at the end, {:.0f} MiB at its most\n", resident_mib(), peak_resident_mib());
}

}  // namespace swarmfit::cli
