// Working memory that is used again: what a fit to the frames of a stream works in is asked for in the first of them.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

namespace swarmfit::kernels {

/// Memory of vectors that a thread is done with, the last one first: where vectors live and die in the same order as before, each gets what
/// the one in its place had.
template <class T>
class Spares {
 public:
  /// Null while a thread ends: what ends after this frees its own.
  static Spares* of_thread() noexcept {
    if (ended()) return nullptr;
    thread_local Spares spares;
    return &spares;
  }
  ~Spares() { ended() = true; }
  Spares(const Spares&) = delete;
  Spares& operator=(const Spares&) = delete;

  std::vector<T> take() noexcept {
    if (count_ == 0) return {};
    std::vector<T>& last = kept_[--count_];
    bytes_ -= bytes_of(last);
    return std::move(last);
  }
  void keep(std::vector<T>&& done) noexcept {
    const std::size_t bytes = bytes_of(done);
    if (bytes == 0 || bytes > kMostBytes || bytes_ + bytes > kMostInAll || count_ == kept_.size()) return;
    done.clear();
    bytes_ += bytes;
    kept_[count_++] = std::move(done);
  }

 private:
  // What is larger, or more, goes back to the system: it may be all there is.
  static constexpr std::size_t kMostBytes = std::size_t{4} << 20, kMostInAll = std::size_t{16} << 20;
  static std::size_t bytes_of(const std::vector<T>& one) noexcept { return one.capacity() * sizeof(T); }

  Spares() = default;
  static bool& ended() noexcept {
    thread_local bool ended = false;
    return ended;
  }

  std::array<std::vector<T>, 48> kept_;
  std::size_t count_ = 0, bytes_ = 0;
};

/// A vector that begins with the memory of one that this thread is done with, and leaves its own to the next. For what lives no longer than
/// a call. What is moved from by assignment has the other's elements: they are swapped.
template <class T>
class Reused : public std::vector<T> {
 public:
  Reused() noexcept : std::vector<T>(spare()) {}
  explicit Reused(std::size_t count) : Reused() { this->resize(count); }
  Reused(std::size_t count, const T& value) : Reused() { this->assign(count, value); }
  template <class It>
  Reused(It first, It last) : Reused() {
    this->assign(first, last);
  }
  Reused(std::initializer_list<T> values) : Reused(values.begin(), values.end()) {}
  Reused(const std::vector<T>& values) : Reused(values.begin(), values.end()) {}   // NOLINT(google-explicit-constructor): it is one
  Reused(std::vector<T>&& values) noexcept : std::vector<T>(std::move(values)) {}  // NOLINT(google-explicit-constructor)
  Reused(const Reused& other) : Reused(other.begin(), other.end()) {}
  Reused(Reused&& other) noexcept : std::vector<T>(std::move(other)) {}
  Reused& operator=(const Reused& other) {
    this->assign(other.begin(), other.end());
    return *this;
  }
  Reused& operator=(Reused&& other) noexcept {
    this->swap(other);
    return *this;
  }
  ~Reused() {
    if (auto* const spares = Spares<T>::of_thread()) spares->keep(std::move(*this));
  }

 private:
  static std::vector<T> spare() noexcept {
    auto* const spares = Spares<T>::of_thread();
    return spares != nullptr ? spares->take() : std::vector<T>();
  }
};

}  // namespace swarmfit::kernels
