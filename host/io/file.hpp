// Whole files in and out, and errors that name the file.
#pragma once

#include <cstddef>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <swarmfit/error.hpp>

#include "host/common/thrown.hpp"

namespace swarmfit::io {

/// A file's bytes, read in one go; the memory is not cleared first.
class FileBytes {
 public:
  FileBytes(std::unique_ptr<char[]> data, std::size_t size) : data_(std::move(data)), size_(size) {}
  const char* data() const noexcept { return data_.get(); }
  std::size_t size() const noexcept { return size_; }
  std::string_view text() const noexcept { return {data_.get(), size_}; }

 private:
  std::unique_ptr<char[]> data_;
  std::size_t size_ = 0;
};

/// Fails with bad_input: missing, a directory, not a regular file, unreadable, empty.
Expected<FileBytes> read_file(const std::filesystem::path& file);

/// A file that appears under its name only once it is whole: bytes go to a temporary beside it, `commit` renames. Dropped
/// without `commit`, it leaves nothing behind.
class PendingFile {
 public:
  /// Fails with cannot_write.
  static Expected<PendingFile> write(const std::filesystem::path& file, std::string_view bytes);
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&&) = delete;
  ~PendingFile();
  Expected<> commit();
  const std::filesystem::path& file() const noexcept { return file_; }

 private:
  PendingFile(std::filesystem::path file, std::filesystem::path temporary);
  std::filesystem::path file_;
  std::filesystem::path temporary_;
};

/// A file or an empty folder that goes again when its scope ends, if it is new and is not kept.
class Tentative {
 public:
  explicit Tentative(std::filesystem::path path) : path_(std::move(path)) {}
  ~Tentative();
  Tentative(const Tentative&) = delete;
  Tentative& operator=(const Tentative&) = delete;
  void is_new(bool yes) noexcept { new_ = yes; }
  void keep() noexcept { new_ = false; }

 private:
  std::filesystem::path path_;
  bool new_ = false;
};

/// "file: what is wrong".
template <class... Args>
tl::unexpected<Error> bad_input(const std::filesystem::path& file, fmt::format_string<Args...> format, Args&&... args) {
  return fail(Error::Kind::bad_input, file.string() + ": " + fmt::format(format, std::forward<Args>(args)...));
}

/// What a file holds, made fit for a message: short, and on one line.
std::string excerpt(std::string_view text);

/// Runs a reader or writer and turns what it may throw into an Error.
template <class F>
auto guarded(const std::filesystem::path& file, Error::Kind kind, F&& body) -> decltype(body()) {
  const auto too_large = [&] { return file.string() + ": does not fit in memory"; };
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return tl::unexpected(common::no_memory(too_large));
  } catch (const std::exception& e) {
    try {
      return fail(kind, file.string() + ": " + excerpt(e.what()));
    } catch (const std::bad_alloc&) {
      return tl::unexpected(common::no_memory(too_large));
    }
  }
}

}  // namespace swarmfit::io
