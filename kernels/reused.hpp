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
    thread_local Spares spares;
    return ended() ? nullptr : &spares;
  }
  ~Spares() { ended() = true; }
  Spares(const Spares&) = delete;
  Spares& operator=(const Spares&) = delete;

  std::vector<T> take() noexcept { return count_ > 0 ? std::move(kept_[--count_]) : std::vector<T>(); }
  void keep(std::vector<T>&& done) noexcept {
    if (done.capacity() == 0 || done.capacity() * sizeof(T) > kMostBytes || count_ == kept_.size()) return;
    done.clear();
    kept_[count_++] = std::move(done);
  }

 private:
  static constexpr std::size_t kMostBytes = std::size_t{4} << 20;  // what is larger goes back to the system: it may be all there is

  Spares() = default;
  static bool& ended() noexcept {
    thread_local bool ended = false;
    return ended;
  }

  std::array<std::vector<T>, 48> kept_;
  std::size_t count_ = 0;
};

/// A vector that begins with the memory of one that this thread is done with, and leaves its own to the next. For what lives no longer than
/// a call.
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
