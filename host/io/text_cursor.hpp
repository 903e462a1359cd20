// Numbers in text, line by line.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstring>
#include <string_view>
#include <system_error>

namespace swarmfit::io {

constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

constexpr std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// The whole of `token` as a number; std::from_chars, but a leading plus is fine. `nan` and `inf` are numbers.
template <class T>
bool parse_number(std::string_view token, T& value) noexcept {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  return error == std::errc() && end == token.data() + token.size() && !token.empty();
}

/// Walks lines, and blank-separated tokens within a line.
class TextCursor {
 public:
  /// `line`: number of the line before the first.
  explicit TextCursor(std::string_view text, std::size_t line = 0) : rest_(text.data()), end_(text.data() + text.size()), number_(line) {}

  /// The next line as it is, without its end; false after the last.
  bool next_raw_line() noexcept {
    if (rest_ == end_) return false;
    const char* stop = static_cast<const char*>(std::memchr(rest_, '\n', static_cast<std::size_t>(end_ - rest_)));
    line_ = rest_;
    line_end_ = stop ? stop : end_;
    rest_ = stop ? stop + 1 : end_;
    ++number_;
    return true;
  }

  /// The next line that is neither blank nor a comment (`#`).
  bool next_line() noexcept {
    while (next_raw_line()) {
      skip_blanks();
      if (line_ != line_end_ && *line_ != '#') return true;
    }
    return false;
  }

  /// The next token of the line; empty at its end.
  std::string_view token() noexcept {
    skip_blanks();
    const char* first = line_;
    while (line_ != line_end_ && !is_blank(*line_)) ++line_;
    return {first, static_cast<std::size_t>(line_ - first)};
  }

  std::string_view rest_of_line() const noexcept { return {line_, static_cast<std::size_t>(line_end_ - line_)}; }
  /// What follows the current line.
  std::string_view rest() const noexcept { return {rest_, static_cast<std::size_t>(end_ - rest_)}; }
  std::size_t line_number() const noexcept { return number_; }

 private:
  void skip_blanks() noexcept {
    while (line_ != line_end_ && is_blank(*line_)) ++line_;
  }

  const char* rest_;
  const char* end_;
  const char* line_ = nullptr;
  const char* line_end_ = nullptr;
  std::size_t number_;
};

}  // namespace swarmfit::io
