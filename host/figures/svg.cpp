#include "host/figures/svg.hpp"

#include <cmath>

#include <fmt/format.h>

namespace swarmfit::figures {
namespace {

/// A tenth of a pixel is enough, and keeps files small.
std::string number(double value) {
  const double tenths = std::round(value * 10);
  return tenths == std::round(value) * 10 ? fmt::format("{:.0f}", tenths / 10) : fmt::format("{:.1f}", tenths / 10);
}

std::string escaped(std::string_view words) {
  std::string out;
  for (const char c : words) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string attributes(const Stroke& stroke) {
  std::string out = fmt::format(R"(fill="none" stroke="{}" stroke-width="{}")", stroke.colour, stroke.width);
  if (stroke.opacity < 1) out += fmt::format(R"( stroke-opacity="{}")", stroke.opacity);
  if (!stroke.dashes.empty()) out += fmt::format(R"( stroke-dasharray="{}")", stroke.dashes);
  return out;
}

}  // namespace

Svg::Svg(int width, int height)
    : out_(fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
                       "font-family=\"Helvetica, Arial, sans-serif\">\n",
                       width, height)) {
  rectangle(Place::Zero(), width, height, "#ffffff");
}

void Svg::rectangle(const Place& corner, double width, double height, const std::string& fill, const std::string& border) {
  out_ += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\" stroke=\"{}\"/>\n", number(corner.x()),
                      number(corner.y()), number(width), number(height), fill, border);
}

void Svg::line(const Place& a, const Place& b, const Stroke& stroke) {
  out_ += fmt::format("<path d=\"M{} {}L{} {}\" {}/>\n", number(a.x()), number(a.y()), number(b.x()), number(b.y()), attributes(stroke));
}

void Svg::polyline(std::span<const Place> places, const Stroke& stroke) {
  if (places.empty()) return;
  out_ += "<path d=\"";
  char verb = 'M';
  for (const Place& p : places) {
    out_ += fmt::format("{}{} {}", verb, number(p.x()), number(p.y()));
    verb = 'L';
  }
  out_ += fmt::format("\" stroke-linejoin=\"round\" {}/>\n", attributes(stroke));
}

void Svg::dots(std::span<const Place> places, double diameter, const std::string& colour, double opacity) {
  if (places.empty()) return;
  out_ += "<path d=\"";
  for (const Place& p : places) out_ += fmt::format("M{} {}h0", number(p.x()), number(p.y()));
  out_ += fmt::format("\" stroke-linecap=\"round\" {}/>\n", attributes({colour, diameter, opacity, {}}));
}

void Svg::text(const Place& at, std::string_view words, const Lettering& lettering) {
  const std::string turned =
      lettering.upright ? fmt::format(" transform=\"rotate(-90 {} {})\"", number(at.x()), number(at.y())) : std::string();
  out_ += fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{}\" fill=\"{}\"{}{}>{}</text>\n", number(at.x()),
                      number(at.y()), lettering.size, lettering.anchor, lettering.colour, lettering.bold ? " font-weight=\"bold\"" : "",
                      turned, escaped(words));
}

std::string Svg::finish() && { return std::move(out_ += "</svg>\n"); }

}  // namespace swarmfit::figures
