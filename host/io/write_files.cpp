// Results to files. Every file is whole before any appears under its name.
#include <array>
#include <charconv>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>

#include <opencv2/core.hpp>

#include <swarmfit/results.hpp>

#include "host/io/file.hpp"
#include "host/io/palette.hpp"
#include "host/io/png.hpp"

namespace swarmfit {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> cannot_write(const fs::path& file, const std::string& why) {
  return fail(Error::Kind::cannot_write, file.string() + ": cannot be written: " + why);
}

Expected<> write_whole(const fs::path& file, std::string_view bytes) {
  return io::guarded(file, Error::Kind::cannot_write, [&]() -> Expected<> {
    auto pending = io::PendingFile::write(file, bytes);
    if (!pending) return tl::unexpected(std::move(pending.error()));
    return pending->commit();
  });
}

/// 16 bits a pixel; all 0 where the stage that would have labelled it was left out.
std::string label_image(const std::vector<std::uint16_t>& labels, const Cloud& input) {
  cv::Mat image = cv::Mat::zeros(input.height, input.width, CV_16U);
  if (labels.size() == input.size()) std::memcpy(image.data, labels.data(), labels.size() * sizeof(std::uint16_t));
  return io::encode_png(image);
}

std::string overlay_image(const PerceiveResult& result, const Cloud& input) {
  std::vector<std::uint8_t> rgb = render_overlay(result, input);
  return io::encode_png(cv::Mat(input.height, input.width, CV_8UC3, rgb.data()));
}

template <class T>
void append(std::string& out, T value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

/// Points in input order, in the source's precision, each with its colour by label, its plane and its SOI.
std::string labelled_ply(const PerceiveResult& result, const Cloud& input) {
  const bool wide = !input.values64.empty();
  const char* scalar = wide ? "double" : "float";
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment swarmfit: plane and soi are 1-based, 0 none\nelement vertex {0}\nproperty {1} x\n"
      "property {1} y\nproperty {1} z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty ushort plane\n"
      "property ushort soi\nend_header\n",
      input.size(), scalar);
  out.reserve(out.size() + input.size() * (3 * (wide ? 8 : 4) + 7));
  const auto dimension = static_cast<std::size_t>(input.dimension);
  for (std::size_t i = 0; i < input.size(); ++i) {
    for (std::size_t d = 0; d < 3; ++d) {
      if (wide) {
        append(out, d < dimension ? input.values64[i * dimension + d] : 0.0);
      } else {
        append(out, d < dimension ? input.values32[i * dimension + d] : 0.0F);
      }
    }
    const std::uint16_t plane = i < result.fit.labels.size() ? result.fit.labels[i] : 0;
    const std::uint16_t soi = i < result.popout.size() ? result.popout[i] : 0;
    for (const std::uint8_t c : soi ? io::kStickingOut : plane ? io::plane_colour(plane) : io::kUnlabelled) append(out, c);
    append(out, plane);
    append(out, soi);
  }
  return out;
}

using Files = std::vector<std::pair<const char*, std::string>>;

/// All temporaries first, then all renames. A folder made for files that could not be written goes again.
Expected<> write_all(const fs::path& folder, const Files& files) {
  io::Tentative made(folder);
  std::error_code error;
  made.is_new(fs::create_directories(folder, error));
  if (error) return cannot_write(folder, error.message());
  std::vector<io::PendingFile> pending;
  for (const auto& [name, bytes] : files) {
    auto file = io::PendingFile::write(folder / name, bytes);
    if (!file) return tl::unexpected(std::move(file.error()));
    pending.push_back(std::move(*file));
  }
  for (auto& file : pending) {
    if (auto ok = file.commit(); !ok) return ok;
  }
  made.keep();
  return {};
}

}  // namespace

Expected<> check_writable(const fs::path& file) {
  return io::guarded(file, Error::Kind::cannot_write, [&]() -> Expected<> {
    // A pipe's reader would take it for the end if it were opened and closed.
    std::error_code none;
    const fs::file_type type = fs::status(file, none).type();
    if (type == fs::file_type::fifo || type == fs::file_type::character || type == fs::file_type::socket) {
      return ::access(file.c_str(), W_OK) == 0 ? Expected<>() : cannot_write(file, std::generic_category().message(errno));
    }
    auto pending = io::PendingFile::write(file, {});
    if (!pending) return tl::unexpected(std::move(pending.error()));
    return {};
  });
}

Expected<> check_writable_folder(const fs::path& folder) {
  return io::guarded(folder, Error::Kind::cannot_write, [&]() -> Expected<> {
    std::error_code error;
    if (folder.empty()) return cannot_write(folder, "the name is empty");
    // The nearest folder that is there already decides.
    fs::path nearest = fs::absolute(folder, error).lexically_normal();
    while (!fs::exists(nearest, error) && nearest.has_relative_path()) nearest = nearest.parent_path();
    if (!fs::is_directory(nearest, error)) return cannot_write(folder, nearest.string() + " is not a folder");
    if (::access(nearest.c_str(), W_OK | X_OK) != 0) return cannot_write(folder, std::generic_category().message(errno));
    return {};
  });
}

Expected<> write_text(const fs::path& file, const std::string& text) { return write_whole(file, text); }

Expected<> write_labels(const fs::path& file, const std::vector<std::uint16_t>& labels) {
  return io::guarded(file, Error::Kind::cannot_write, [&]() -> Expected<> {
    std::string text(labels.size() * 6, '\n');  // five digits and a line's end at the most
    char* at = text.data();
    for (const std::uint16_t label : labels) {
      at = std::to_chars(at, at + 5, label).ptr;
      *at++ = '\n';
    }
    return write_whole(file, std::string_view(text.data(), static_cast<std::size_t>(at - text.data())));
  });
}

Expected<> write_perception(const fs::path& folder, const PerceiveResult& result, const Cloud& input) {
  return io::guarded(folder, Error::Kind::cannot_write, [&]() -> Expected<> {
    Files files;
    files.emplace_back("result.json", to_json(result, input));
    if (input.organised()) {
      files.emplace_back("planes.png", label_image(result.fit.labels, input));
      files.emplace_back("popout.png", label_image(result.popout, input));
      files.emplace_back("objects.png", label_image(result.objects, input));
      files.emplace_back("overlay.png", overlay_image(result, input));
    } else {
      files.emplace_back("labelled.ply", labelled_ply(result, input));
    }
    return write_all(folder, files);
  });
}

}  // namespace swarmfit
