#include "host/cli/help_format.hpp"

#include <algorithm>
#include <sstream>
#include <string_view>

namespace swarmfit::cli {
namespace {

constexpr std::size_t kLine = 80;
constexpr std::size_t kDescription = 32;  // where descriptions begin

/// Words in lines that begin with `indent` spaces, the first of which holds `head` as well; `end` closes each line but the last.
std::string in_lines(std::string head, std::string_view text, std::size_t indent, std::string_view end) {
  std::string out, line = std::move(head);
  std::istringstream words{std::string(text)};
  bool begun = false;
  for (std::string word; words >> word;) {
    if (begun && line.size() + 1 + word.size() + end.size() > kLine) {
      out += line.append(end) + '\n';
      line.assign(indent, ' ');
      begun = false;
    }
    line += (begun ? " " : "") + word;
    begun = true;
  }
  return out + line;
}

std::string folded_line(const std::string& line) {
  const std::size_t first = line.find_first_not_of(' ');
  if (line.size() <= kLine || first == std::string::npos) return line;
  // What comes after two spaces describes what comes before.
  const std::size_t gap = line.find("  ", first);
  if (gap == std::string::npos) {
    const bool command = first == 2;
    return in_lines(line.substr(0, first), line.substr(first), command ? first + 4 : first, command ? " \\" : "");
  }
  const std::string description = line.substr(line.find_first_not_of(' ', gap));
  const std::size_t begin = line.size() - description.size();
  if (begin <= kLine / 2 + 10) return in_lines(line.substr(0, begin), description, begin, "");
  return line.substr(0, gap) + '\n' + in_lines(std::string(kDescription, ' '), description, kDescription, "");
}

}  // namespace

std::string folded(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) out += folded_line(line) + '\n';
  if (!text.empty() && text.back() != '\n') out.pop_back();
  return out;
}

}  // namespace swarmfit::cli
