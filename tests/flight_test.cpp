// A step of lines and planes on vectors, on every instruction set, against the same by the maps of the sphere.
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "host/models/sphere_maps.hpp"
#include "kernels/cpu/flight_kernels.hpp"

namespace swarmfit {
namespace {

using kernels::HyperplaneFlight;
using Row = HyperplaneFlight::Row;

constexpr double kInertia = 0.73;

template <int D>
using Flat = Eigen::Matrix<double, D + 1, 1>;

/// One particle, moved one at a time.
template <int D>
void step_plainly(Flat<D>& at, Flat<D>& velocity, const Flat<D>& own, const Flat<D>& best, const Flat<D>& pull_own,
                  const Flat<D>& pull_best) {
  using Vector = Eigen::Matrix<double, D, 1>;
  const auto way = [&](Flat<D> to) {
    const Vector n = at.template head<D>();
    if (n.dot(to.template head<D>()) < 0) to = -to;
    Flat<D> there;
    there.template head<D>() = models::way_between(n, Vector(to.template head<D>()));
    there[D] = to[D] - at[D];
    return there;
  };
  velocity = kInertia * velocity + pull_own.cwiseProduct(way(own)) + pull_best.cwiseProduct(way(best));
  Vector n = at.template head<D>(), v = velocity.template head<D>();
  models::follow(n, v);
  at.template head<D>() = n;
  velocity.template head<D>() = v;
  at[D] += velocity[D];
}

/// Places near and far from each other, the same, opposite, and at right angles; velocities small, none, and beyond a quarter turn.
template <int D>
class Particles {
 public:
  explicit Particles(std::size_t count) : random_(static_cast<unsigned>(count) + D) {
    for (std::size_t j = 0; j < count; ++j) {
      at.push_back(flat());
      own.push_back(j % 5 == 0   ? at[j]
                    : j % 5 == 1 ? Flat<D>(-at[j])
                    : j % 5 == 2 ? near(at[j], 1e-9)
                    : j % 5 == 3 ? across(at[j])
                                 : flat());
      best.push_back(j % 3 == 0 ? near(at[j], 0.01) : flat());
      velocity.push_back(Flat<D>::Zero());
      if (j % 4 != 0) velocity[j] = Flat<D>::NullaryExpr([&] { return (j % 4 == 1 ? 3 : 0.01) * normal_(random_); });
      pull_own.push_back(Flat<D>::NullaryExpr([&] { return 1.5 * unit_(random_); }));
      pull_best.push_back(Flat<D>::NullaryExpr([&] { return 1.5 * unit_(random_); }));
    }
  }
  HyperplaneFlight columns() const {
    HyperplaneFlight flight(D, at.size());
    for (std::size_t j = 0; j < at.size(); ++j) {
      const Flat<D>* const rows[] = {&at[j], &velocity[j], &own[j], &best[j], &pull_own[j], &pull_best[j]};
      for (std::size_t row = 0; row < Row::kRows; ++row) {
        for (std::size_t d = 0; d <= D; ++d) flight.row(static_cast<Row>(row), d)[j] = (*rows[row])[static_cast<int>(d)];
      }
    }
    return flight;
  }

  std::vector<Flat<D>> at, velocity, own, best, pull_own, pull_best;

 private:
  Flat<D> flat() {
    Flat<D> f = Flat<D>::NullaryExpr([&] { return normal_(random_); });
    f.template head<D>().normalize();
    return f;
  }
  Flat<D> near(Flat<D> f, double far) {
    f += Flat<D>::NullaryExpr([&] { return far * normal_(random_); });
    f.template head<D>().normalize();
    return f;
  }
  /// At right angles, as nearly as numbers tell.
  Flat<D> across(Flat<D> f) {
    f.template head<D>() = f.template head<D>().unitOrthogonal().eval();
    return f;
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> unit_{0, 1};
};

template <int D>
void expect_the_same(const kernels::cpu::FlightKernels& kernels) {
  for (const std::size_t count : {1, 7, 8, 9, 64, 1001}) {
    SCOPED_TRACE(count);
    Particles<D> particles(count);
    HyperplaneFlight flight = particles.columns();
    kernels.step(flight, kInertia);
    for (std::size_t j = 0; j < count; ++j) {
      SCOPED_TRACE(j);
      // At right angles either of two ways is the shortest.
      if (std::abs(particles.at[j].template head<D>().dot(particles.own[j].template head<D>())) < 1e-12) continue;
      Flat<D> at = particles.at[j], velocity = particles.velocity[j];
      step_plainly<D>(at, velocity, particles.own[j], particles.best[j], particles.pull_own[j], particles.pull_best[j]);
      double length = 0;
      for (std::size_t d = 0; d <= D; ++d) {
        const double x = flight.row(Row::position, d)[j];
        EXPECT_NEAR(x, at[static_cast<int>(d)], 1e-12);
        EXPECT_NEAR(flight.row(Row::velocity, d)[j], velocity[static_cast<int>(d)], 1e-12);
        length += d < D ? x * x : 0;
      }
      EXPECT_NEAR(length, 1, 1e-13);
    }
  }
}

class Flight : public testing::TestWithParam<const kernels::cpu::FlightKernels*> {};

TEST_P(Flight, LinesFlyAsOneByOne) { expect_the_same<2>(*GetParam()); }
TEST_P(Flight, PlanesFlyAsOneByOne) { expect_the_same<3>(*GetParam()); }

TEST_P(Flight, WhatWouldGetNowhereFiniteStaysAndStandsStill) {
  constexpr double kHuge = std::numeric_limits<double>::max();
  Particles<3> particles(3);
  particles.velocity[1] = Flat<3>(0.1, 0, 0, kHuge);
  particles.at[1] = Flat<3>(0, 0, 1, kHuge);
  particles.own[1] = particles.best[1] = particles.at[1];
  HyperplaneFlight flight = particles.columns();
  GetParam()->step(flight, 1);
  for (std::size_t d = 0; d <= 3; ++d) {
    EXPECT_EQ(flight.row(Row::position, d)[1], particles.at[1][static_cast<int>(d)]);
    EXPECT_EQ(flight.row(Row::velocity, d)[1], 0);
    EXPECT_NE(flight.row(Row::position, 0)[2], particles.at[2][0]) << "the others fly";
  }
}

INSTANTIATE_TEST_SUITE_P(OnEach, Flight, testing::ValuesIn(kernels::cpu::available_flight_kernels()),
                         [](const auto& one) { return std::string(one.param->name); });

}  // namespace
}  // namespace swarmfit
