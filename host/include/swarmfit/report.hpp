// A result as one HTML page to look at: the cloud in 3D, the search replayed, the image, the numbers. It asks nothing of the network.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>
#include <swarmfit/trace.hpp>

namespace swarmfit {

/// A search to be replayed, thinned while it grows so that a page can hold it: at most 64 particles of each step, and of a long search
/// every second step, every fourth ...
class SWARMFIT_API SearchRecord {
 public:
  struct Step {
    ModelType type = ModelType::plane;
    std::size_t swarm = 0, step = 0;
    Eigen::MatrixXd positions;  ///< as in SwarmStep
    std::vector<double> fitness;
    Eigen::VectorXd best;
    double best_fitness = 0, nothing_explained = 0;
  };
  struct Found {
    Model model;
    std::size_t after = 0;  ///< as many of steps() came before
  };

  void add(const SwarmStep& step);
  void add(const Model& found);

  const std::vector<Step>& steps() const noexcept { return steps_; }
  const std::vector<Found>& found() const noexcept { return found_; }
  std::size_t particles() const noexcept { return particles_; }  ///< of the largest step, before thinning
  std::size_t every() const noexcept { return every_; }          ///< one in so many steps was kept

 private:
  void thin();
  std::vector<Step> steps_;
  std::vector<Found> found_;
  std::size_t particles_ = 0, every_ = 1, seen_ = 0;
};

/// What a page tells beside the result.
struct ReportNotes {
  struct Setting {
    std::string name, value;
    bool given = false;  ///< else it is the default
  };
  std::string title;    ///< of the page: "fit plane room.pcd"
  std::string command;  ///< what to type to have the same again
  std::vector<Setting> settings;
};

/// Can this build write pages? Fails with cannot_write and what was missing when it was made.
SWARMFIT_API Expected<> check_report();

/// The whole page. Clouds of more than 300 000 finite points and large images are shown thinned, and the page says so. `load_ms`: time [ms]
/// spent reading the input. Fails as check_report() does, or with out_of_memory.
SWARMFIT_API Expected<std::string> report_page(const FitResult& result, const Cloud& input, double load_ms, const SearchRecord& search,
                                               const ReportNotes& notes);
SWARMFIT_API Expected<std::string> report_page(const PerceiveResult& result, const Cloud& input, const SearchRecord& search,
                                               const ReportNotes& notes);

}  // namespace swarmfit
