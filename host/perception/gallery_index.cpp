#include "host/perception/gallery_index.hpp"

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include <swarmfit/results.hpp>

namespace swarmfit::perception {
namespace {

constexpr std::string_view kMagic = "swarmfit features 1\n";
constexpr std::uint32_t kColumns = 128;
constexpr std::uint32_t kMostPoints = 1 << 20;

/// FNV-1a.
std::uint64_t hash(std::string_view bytes) {
  std::uint64_t value = 0xcbf29ce484222325ULL;
  for (const char c : bytes) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return value;
}

template <class T>
void append(std::string& out, const T& value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

template <class T>
bool take(std::string_view& in, T& value) {
  if (in.size() < sizeof value) return false;
  std::memcpy(&value, in.data(), sizeof value);
  in.remove_prefix(sizeof value);
  return true;
}

struct Point {
  float x, y, size, angle, response;
  std::int32_t octave;
};

void append(std::string& out, const Features& features) {
  append(out, static_cast<std::int32_t>(features.size.width));
  append(out, static_cast<std::int32_t>(features.size.height));
  append(out, static_cast<std::uint32_t>(features.points.size()));
  for (const auto& p : features.points) append(out, Point{p.pt.x, p.pt.y, p.size, p.angle, p.response, p.octave});
  for (int row = 0; row < features.descriptors.rows; ++row)
    out.append(reinterpret_cast<const char*>(features.descriptors.ptr<float>(row)), kColumns * sizeof(float));
}

bool take(std::string_view& in, Features& features) {
  std::int32_t width = 0, height = 0;
  std::uint32_t count = 0;
  if (!take(in, width) || !take(in, height) || !take(in, count) || width < 1 || height < 1 || count > kMostPoints) return false;
  if (in.size() < count * (sizeof(Point) + kColumns * sizeof(float))) return false;
  features.size = {width, height};
  for (std::uint32_t i = 0; i < count; ++i) {
    Point p{};
    if (!take(in, p) || !std::isfinite(p.x + p.y + p.size + p.angle)) return false;
    features.points.emplace_back(p.x, p.y, p.size, p.angle, p.response, p.octave);
  }
  if (count == 0) return true;
  features.descriptors.create(static_cast<int>(count), static_cast<int>(kColumns));
  const std::size_t bytes = count * kColumns * sizeof(float);
  std::memcpy(features.descriptors.data, in.data(), bytes);
  in.remove_prefix(bytes);
  return true;
}

}  // namespace

GalleryIndex GalleryIndex::read(const std::filesystem::path& folder) {
  std::ifstream stream(folder / kFileName, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  std::string_view in = text;
  GalleryIndex index;
  std::uint64_t checked = 0;
  if (!in.starts_with(kMagic)) return index;
  in.remove_prefix(kMagic.size());
  if (!take(in, checked) || hash(in) != checked) return index;
  while (!in.empty()) {
    std::pair<std::uint64_t, std::uint64_t> key;
    Entry entry;
    if (!take(in, key.first) || !take(in, key.second) || !take(in, entry.features)) return {};
    index.entries_.insert_or_assign(key, std::move(entry));
  }
  return index;
}

Expected<> GalleryIndex::write(const std::filesystem::path& folder) const {
  std::string body;
  for (const auto& [key, entry] : entries_) {
    if (!entry.used) continue;
    append(body, key.first);
    append(body, key.second);
    append(body, entry.features);
  }
  std::string text(kMagic);
  append(text, hash(body));
  return write_text(folder / kFileName, text + body);
}

const Features* GalleryIndex::find(std::string_view picture) {
  const auto at = entries_.find({picture.size(), hash(picture)});
  if (at == entries_.end()) return nullptr;
  at->second.used = true;
  return &at->second.features;
}

const Features& GalleryIndex::put(std::string_view picture, Features features) {
  return entries_.insert_or_assign({picture.size(), hash(picture)}, Entry{std::move(features), true}).first->second.features;
}

}  // namespace swarmfit::perception
