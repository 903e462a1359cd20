// swarmfit bench
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <swarmfit/backend.hpp>
#include <swarmfit/bench.hpp>
#include <swarmfit/cloud.hpp>
#include <swarmfit/results.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/options.hpp"
#include "host/cli/report.hpp"

namespace swarmfit::cli {
namespace {

struct BenchArguments {
  std::string points, particles, backend, model, pruning = "off", json, threads = "0", seconds = "0.3", seed = "1";
  bool quiet = false;
};

struct BenchPlan {
  BenchOptions options;
  std::string file;  ///< --points names a file
};

tl::unexpected<Error> invalid(std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); }

Expected<std::vector<std::size_t>> counts(const std::string& option, const std::string& text) {
  const auto values = parse_list(option, text, "N,N", 0);
  if (!values) return tl::unexpected(values.error());
  std::vector<std::size_t> out;
  for (const double value : *values) {
    if (!(value >= 1 && value <= 1e9) || value != static_cast<double>(static_cast<std::size_t>(value))) {
      return invalid(fmt::format("{}: {}, must be whole numbers in 1..1000000000", option, text));
    }
    out.push_back(static_cast<std::size_t>(value));
  }
  return out;
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> out;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    if (comma > start) out.push_back(text.substr(start, comma - start));
    start = comma + 1;
  }
  return out;
}

Expected<BenchPlan> plan(const BenchArguments& arguments) {
  BenchPlan plan;
  BenchOptions& options = plan.options;
  if (!arguments.points.empty()) {
    if (arguments.points.find_first_not_of("0123456789,.e+-") == std::string::npos) {
      auto points = counts("--points", arguments.points);
      if (!points) return tl::unexpected(points.error());
      options.points = std::move(*points);
    } else {
      plan.file = arguments.points;
    }
  }
  if (!arguments.particles.empty()) {
    auto particles = counts("--particles", arguments.particles);
    if (!particles) return tl::unexpected(particles.error());
    options.particles = std::move(*particles);
  }
  options.backends = split(arguments.backend);
  if (options.backends.empty() && !arguments.backend.empty())
    return invalid(fmt::format("--backend: {}, must be NAME,NAME", arguments.backend));
  if (split(arguments.model).empty() && !arguments.model.empty())
    return invalid(fmt::format("--model: {}, must be MODEL,MODEL", arguments.model));
  for (const auto& name : split(arguments.model)) {
    const auto type = model_type(name);
    if (!type) return tl::unexpected(type.error());
    options.models.push_back(*type);
  }
  if (arguments.pruning == "off") {
    options.pruning = {false};
  } else if (arguments.pruning == "on") {
    options.pruning = {true};
  } else if (arguments.pruning == "both") {
    options.pruning = {false, true};
  } else {
    return invalid(fmt::format("--pruning: {}, must be off, on or both", arguments.pruning));
  }
  const auto seconds = parse_number(arguments.seconds);
  if (!seconds || !(*seconds > 0 && *seconds <= 3600))
    return invalid(fmt::format("--seconds: {}, must be in (0, 3600]", arguments.seconds));
  options.seconds = *seconds;
  // As fits take them.
  FitFlags flags;
  flags.threads = arguments.threads;
  flags.seed = arguments.seed;
  FitOptions fit;
  if (auto ok = flags.apply(fit); !ok) return tl::unexpected(ok.error());
  options.threads = fit.threads;
  options.seed = fit.seed;
  return plan;
}

std::string report_table(const BenchReport& report) {
  std::string out;
  std::vector<std::vector<std::string>> rows;
  for (std::size_t k = 0; k < report.rows.size(); ++k) {
    const BenchRow& row = report.rows[k];
    if (rows.empty()) rows = {{"model", "points", "particles", "pruning", "Geval/s", "of FMA limit", "ms a swarm", "max rel. error"}};
    rows.push_back({row.model, std::to_string(row.points), std::to_string(row.particles), row.pruning ? "on" : "off",
                    fmt::format("{:.2f}", row.evaluations_per_s * 1e-9), fmt::format("{:.0f} %", 100 * row.fraction_of_limit),
                    fmt::format("{:.3f}", row.seconds * 1e3), fmt::format("{:.1e}", row.max_relative_error)});
    const bool last = k + 1 == report.rows.size();
    if (last || report.rows[k + 1].backend != row.backend || report.rows[k + 1].device != row.device) {
      out += fmt::format("{}: {}\n{}", row.backend, row.device, table(rows));
      rows.clear();
    }
  }
  return out + fmt::format("the CPU reached {:.1f} G fused multiply-adds a second in this run, {} thread{}\n", report.fma_per_s * 1e-9,
                           report.threads, report.threads == 1 ? "" : "s");
}

/// How many rows a bench has; `from_file`: its points are one size.
std::size_t rows_of(const BenchOptions& options, bool from_file) {
  std::size_t backends = options.backends.size();
  if (backends == 0) {
    const auto all = devices();
    backends = static_cast<std::size_t>(
        std::count_if(all.begin(), all.end(), [](const Device& device) { return device.usable && device.backend != "reference"; }));
  }
  const std::size_t models = options.models.empty() ? model_types().size() : options.models.size();
  return backends * models * (from_file ? 1 : options.points.size()) * options.particles.size() * options.pruning.size();
}

int run(const BenchArguments& arguments) {
  const auto checked = plan(arguments);
  if (!checked) return complain(checked.error());
  if (!arguments.json.empty()) {
    if (auto ok = check_writable(arguments.json); !ok) return complain(ok.error());
  }
  std::optional<Cloud> cloud;
  PointsView view;
  if (!checked->file.empty()) {
    auto read = read_cloud(checked->file);
    if (!read) return complain(read.error());
    cloud = std::move(*read);
    view = cloud->points();
  }
  Expected<BenchReport> report;
  {
    Progress progress(arguments.quiet);
    const std::size_t whole = rows_of(checked->options, cloud.has_value());
    std::size_t started = 0;
    report = bench(checked->options, cloud ? &view : nullptr, [&](const std::string& row) {
      progress.step(fmt::format("row {} of {}: {}", started + 1, whole, row), started, whole);
      ++started;
    });
  }
  if (!report) return complain(report.error());
  if (!arguments.json.empty()) {
    if (auto ok = write_text(arguments.json, to_json(*report)); !ok) return complain(ok.error());
  }
  if (!arguments.quiet) fmt::print("{}", report_table(*report));
  return kDone;
}

}  // namespace

Command add_bench(CLI::App& app) {
  auto a = std::make_shared<BenchArguments>();
  CLI::App* sub = app.add_subcommand("bench", "Fitness throughput of each back end, against the machine's limit");
  sub->add_option("--points", a->points, "Sizes of the cloud, or a file to take the points from [10000,100000,307200]")
      ->type_name("N,N|FILE");
  sub->add_option("--particles", a->particles, "Sizes of the swarm [64,256]")->type_name("N,N");
  sub->add_option("--backend", a->backend, "Back ends, parted by commas [every usable one]")->type_name("NAME,NAME");
  sub->add_option("--model", a->model, "Kinds of model, parted by commas [all]")->type_name("MODEL,MODEL");
  sub->add_option("--pruning", a->pruning, "off: brute force; on: lossless pruning, in effective evaluations")
      ->type_name("off|on|both")
      ->capture_default_str();
  sub->add_option("--threads", a->threads, "Threads of the CPU back end; 0: all")->type_name("N")->capture_default_str();
  sub->add_option("--seconds", a->seconds, "Least time a row is run for")->type_name("S")->capture_default_str();
  sub->add_option("--seed", a->seed, "Of the made-up points and particles")->type_name("N")->capture_default_str();
  sub->add_option("--json", a->json, "The rows as JSON; - for standard output, alone")
      ->transform([a = a.get()](const std::string& file) { return file_or_stdout(file, a->quiet); })
      ->type_name("FILE");
  sub->add_flag("--quiet", a->quiet, "No table, no progress");
  sub->footer(
      "Each row's costs are checked against the reference back end before it is timed.\n"
      "An evaluation is one particle's residual at one point.\n\nexamples:\n  swarmfit bench\n  swarmfit bench --backend cpu --points "
      "1000000 --particles 1024 --seconds 2");
  return {sub, [a] { return run(*a); }};
}

}  // namespace swarmfit::cli
