// Flies the swarms of one search, as long as it may go on.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <string_view>
#include <utility>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/swarm/landscape.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/unexplained.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

class Sampler;
class Swarm;

using Clock = std::chrono::steady_clock;

/// When to end early.
struct Limits {
  Clock::time_point start = Clock::now();
  double budget_ms = 0;
  std::stop_token stop;
  std::size_t max_models = 0;
};

/// Who looks on, over all searches of one fit.
struct Watch {
  SwarmObserver observer;  ///< never empty
  std::size_t swarms = 0;  ///< flown so far, of whatever purpose
};

class Pilot {
 public:
  Pilot(const Problem& problem, const Unexplained& left, Limits limits);

  /// Told of each step of each swarm; must outlive this. Null: nobody is.
  void watched_by(Watch* watch) noexcept { watch_ = watch; }
  const Limits& limits() const noexcept { return limits_; }
  double elapsed_ms() const;
  /// Why the search must not go on, if so.
  std::optional<std::string_view> interrupted() const;

  /// Flies a swarm over the caps that were shown last, which are `caps`; false if it ended early, and why_ended() tells. Samples are of
  /// points whose cap is at least `alive`. Each `round` is another draw.
  Expected<bool> fly(Swarm& swarm, std::size_t kind, std::uint32_t round, std::span<const models::Position> seeds,
                     std::span<const float> caps, float alive);
  /// Number of the next swarm.
  std::uint32_t next_round() noexcept { return round_++; }
  /// Makes this another search than one of the same seed.
  void draw_otherwise() noexcept { round_ = kOtherwise; }

  Landscape& landscape(std::size_t kind) noexcept { return landscapes_[kind]; }
  /// Loss of a model that explains nothing, where the last swarm flew.
  double scale() const noexcept { return scale_; }
  /// Of the swarms since it was set, asides left out.
  std::size_t steps() const noexcept { return steps_; }
  void set_steps(std::size_t steps) noexcept { steps_ = steps; }
  /// Why the search is over; empty while it goes on.
  std::string_view why_ended() const noexcept { return why_ended_; }
  /// `why` must outlive this: it is a text of the program's.
  void end(std::string_view why) noexcept { why_ended_ = why; }
  void go_on() noexcept { why_ended_ = {}; }

  /// What is flown while this lives counts no steps, and ends the search only where that was interrupted.
  class Aside {
   public:
    explicit Aside(Pilot& pilot) : pilot_(pilot), steps_(pilot.steps_), why_ended_(pilot.why_ended_) {}
    ~Aside() {
      pilot_.steps_ = steps_;
      if (!pilot_.interrupted()) pilot_.why_ended_ = why_ended_;
    }
    Aside(const Aside&) = delete;
    Aside& operator=(const Aside&) = delete;

   private:
    Pilot& pilot_;
    std::size_t steps_;
    std::string_view why_ended_;
  };

 private:
  static constexpr std::uint32_t kOtherwise = 1U << 20;  // more swarms than any search flies

  Expected<> watched_step(Swarm& swarm, std::size_t kind, const Sampler& sampler);
  double loss_of_nothing(std::span<const float> caps) const;
  /// What chance would save along the models of a kind, under these caps.
  Background background(std::size_t kind, std::span<const float> caps) const;

  const Problem& problem_;
  const Unexplained& left_;
  Limits limits_;
  const models::Neighbours none_;
  kernels::Reused<Landscape> landscapes_;  // of the points that are searched, one a kind
  Watch* watch_ = nullptr;
  std::uint32_t round_ = 0;
  double scale_ = 0;
  std::size_t steps_ = 0;
  std::string_view why_ended_;
};

}  // namespace swarmfit::swarm
