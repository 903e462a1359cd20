// result.json, schema 1: one writer for both kinds of result, keys always in the same order.
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <swarmfit/results.hpp>

namespace swarmfit {
namespace {

/// The shortest text that reads back as the same double; JSON has no NaN and no infinity.
std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "null"; }

std::string text(std::string_view value) { return nlohmann::json(value).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace); }

/// [a,b,c] of anything that gives numbers by index.
template <class Values>
std::string list(const Values& values, Eigen::Index size) {
  std::string out = "[";
  for (Eigen::Index i = 0; i < size; ++i) out += (i ? "," : "") + number(values[i]);
  return out + "]";
}

std::string rows(const Eigen::MatrixXd& matrix) {
  std::string out = "[";
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    if (r) out += ",";
    out += list(matrix.row(r), matrix.cols());
  }
  return out + "]";
}

std::string parameters(const Model& model) {
  const Eigen::VectorXd& p = model.parameters;
  switch (model.type) {
    case ModelType::line2d:
    case ModelType::plane: return fmt::format(R"({{"normal":{},"offset":{}}})", list(p, p.size() - 1), number(model.offset()));
    case ModelType::circle2d:
    case ModelType::sphere: return fmt::format(R"({{"centre":{},"radius":{}}})", list(p, p.size() - 1), number(p[p.size() - 1]));
    case ModelType::cylinder:
      return fmt::format(R"({{"point":{},"axis":{},"radius":{}}})", list(p.head<3>(), 3), list(p.segment<3>(3), 3), number(p[6]));
    case ModelType::homography:
    case ModelType::fundamental: return fmt::format(R"({{"matrix":{}}})", rows(p.reshaped<Eigen::RowMajor>(3, 3)));
    case ModelType::own: return fmt::format(R"({{"values":{}}})", list(p, p.size()));
  }
  return "{}";
}

/// Only of what is followed over frames.
std::string id(std::uint64_t value) { return value == 0 ? "" : fmt::format(R"(,"id":{})", value); }

std::string json(const Model& m) {
  return fmt::format(
      R"({{"type":{},"parameters":{},"inliers":{},"cost":{},"rms":{},"covariance":{},"supporting":{},"iterations":{},"evaluations":{},)"
      R"("points_touched":{},"found_at_ms":{}{}}})",
      text(name(m.type)), parameters(m), m.inliers, number(m.cost), number(m.rms), rows(m.covariance), m.supporting, m.iterations,
      m.evaluations, number(m.points_touched), number(m.found_at_ms), id(m.id));
}

std::string json(const SpaceOfInterest& soi) {
  std::string names;
  for (const auto& r : soi.recognised) {
    if (!names.empty()) names += ",";
    names += fmt::format(R"({{"name":{},"inliers":{},"score":{}}})", text(r.name), r.inliers, number(r.score));
  }
  return fmt::format(R"({{"centre":{},"radius":{},"points":{},"plane":{},"bbox":[{},{},{},{}],"recognised":[{}]{}}})", list(soi.centre, 3),
                     number(soi.radius), soi.points, soi.plane, soi.bbox[0], soi.bbox[1], soi.bbox[2], soi.bbox[3], names, id(soi.id));
}

/// One item a line.
template <class Items>
std::string array(const Items& items) {
  std::string out;
  for (const auto& item : items) out += (out.empty() ? "\n    " : ",\n    ") + json(item);
  return out.empty() ? "[]" : "[" + out + "\n  ]";
}

std::string document(const FitResult& fit, const std::vector<SpaceOfInterest>& sois, const Cloud& input, const std::string& timing,
                     const std::string& frame = {}) {
  std::string out = "{\n  \"schema\": 1,\n" + frame;
  out += fmt::format("  \"input\": {{\"points\":{},\"finite\":{},\"width\":{},\"height\":{}}},\n", input.size(), fit.finite_points,
                     input.width, input.height);
  out += fmt::format("  \"backend\": {{\"name\":{},\"device\":{},\"reason\":{}}},\n", text(fit.backend.name), text(fit.backend.device),
                     text(fit.backend.reason));
  out += fmt::format("  \"seed\": {},\n  \"threshold\": {},\n  \"stop_reason\": {},\n", fit.seed, number(fit.threshold),
                     text(fit.stop_reason));
  out += "  \"models\": " + array(fit.models) + ",\n  \"sois\": " + array(sois) + ",\n  \"timing_ms\": " + timing + "\n}\n";
  return out;
}

}  // namespace

std::string to_json(const FitResult& result, const Cloud& input, double load_ms) {
  const auto timing =
      fmt::format(R"({{"total":{},"load":{},"fit":{}}})", number(result.total_ms), number(load_ms), number(result.total_ms));
  return document(result, {}, input, timing);
}

namespace {

std::string perception_document(const PerceiveResult& result, const Cloud& input, const std::string& frame) {
  const auto& t = result.timing_ms;
  const auto timing = fmt::format(R"({{"total":{},"load":{},"fit":{},"popout":{},"segment":{},"recognise":{}}})", number(t.total),
                                  number(t.load), number(t.fit), number(t.popout), number(t.segment), number(t.recognise));
  return document(result.fit, result.sois, input, timing, frame);
}

}  // namespace

std::string to_json(const PerceiveResult& result, const Cloud& input) { return perception_document(result, input, {}); }

std::string to_json_line(const PerceiveResult& result, const Cloud& input, std::size_t index, const std::string& name) {
  const auto frame = fmt::format("  \"frame\": {{\"index\":{},\"name\":{}}},\n", index, text(name));
  const auto document = perception_document(result, input, frame);
  // Texts hold no line's end: JSON escapes it.
  std::string line;
  line.reserve(document.size() + 1);
  for (std::size_t i = 0; i < document.size(); ++i) {
    if (document[i] != '\n') {
      line += document[i];
      continue;
    }
    while (i + 1 < document.size() && document[i + 1] == ' ') ++i;
  }
  return line + "\n";
}

}  // namespace swarmfit
