#include "host/io/file.hpp"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace swarmfit::io {
namespace {

/// Closes a file descriptor when its scope ends.
struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

std::string reason(int error) { return std::generic_category().message(error); }

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0) {
      if (errno == EINTR) continue;
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  const bool cut = text.size() > kLongest;
  std::string out = "'";
  for (const char c : text.substr(0, kLongest)) out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  return out + (cut ? "…'" : "'");
}

Expected<FileBytes> read_file(const std::filesystem::path& file) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (in.fd < 0) return bad_input(file, "cannot be opened: {}", reason(errno));
  struct stat info {};
  if (::fstat(in.fd, &info) != 0) return bad_input(file, "cannot be opened: {}", reason(errno));
  if (S_ISDIR(info.st_mode)) return bad_input(file, "is a folder, must be a file");
  if (!S_ISREG(info.st_mode)) return bad_input(file, "is not a regular file");
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size == 0) return bad_input(file, "is empty");

  auto data = std::make_unique_for_overwrite<char[]>(size);
  std::size_t have = 0;
  while (have < size) {
    const ssize_t n = ::read(in.fd, data.get() + have, size - have);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return bad_input(file, "cannot be read: {}", reason(errno));
    if (n == 0) return bad_input(file, "ends after {} bytes, must hold {}", have, size);
    have += static_cast<std::size_t>(n);
  }
  return FileBytes(std::move(data), size);
}

PendingFile::PendingFile(std::filesystem::path file, std::filesystem::path temporary)
    : file_(std::move(file)), temporary_(std::move(temporary)) {}

PendingFile::PendingFile(PendingFile&& other) noexcept : file_(std::move(other.file_)), temporary_(std::exchange(other.temporary_, {})) {}

PendingFile::~PendingFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Expected<PendingFile> PendingFile::write(const std::filesystem::path& file, std::string_view bytes) {
  const auto cannot = [&](int error) {
    return fail(Error::Kind::cannot_write, fmt::format("{}: cannot be written: {}", file.string(), reason(error)));
  };
  struct stat info {};
  const bool exists = ::stat(file.c_str(), &info) == 0;
  if (exists && S_ISDIR(info.st_mode)) return cannot(EISDIR);
  if (exists && !S_ISREG(info.st_mode)) {  // a device or a pipe is written to, never replaced
    const Descriptor out{::open(file.c_str(), O_WRONLY | O_CLOEXEC)};
    if (out.fd < 0 || !write_all(out.fd, bytes)) return cannot(errno);
    return PendingFile(file, {});
  }
  if (exists && ::access(file.c_str(), W_OK) != 0) return cannot(errno);

  std::error_code error;
  std::filesystem::path target = exists ? std::filesystem::canonical(file, error) : file;  // a link stays a link
  if (error) return cannot(error.value());
  static std::atomic<unsigned> counter = 0;
  std::filesystem::path temporary = target.parent_path() / fmt::format(".{}.{}-{}.tmp", target.filename().string(), ::getpid(), counter++);
  const Descriptor out{::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)};
  if (out.fd < 0) return cannot(errno);
  PendingFile pending(std::move(target), std::move(temporary));  // takes no memory: what is there now goes again
  if (!write_all(out.fd, bytes)) return cannot(errno);
  return pending;
}

Tentative::~Tentative() {
  if (new_) std::remove(path_.c_str());
}

Expected<> PendingFile::commit() {
  if (temporary_.empty()) return {};
  if (std::rename(temporary_.c_str(), file_.c_str()) != 0) {
    return fail(Error::Kind::cannot_write, fmt::format("{}: cannot be written: {}", file_.string(), reason(errno)));
  }
  temporary_.clear();
  return {};
}

}  // namespace swarmfit::io
