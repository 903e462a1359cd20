#include "kernels/vulkan/pipeline_cache.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <system_error>

#include <fmt/format.h>

namespace swarmfit::kernels::vulkan {
namespace {

constexpr char kMagic[8] = {'s', 'w', 'f', 'p', 'i', 'p', 'e', '1'};
struct Header {
  char magic[8];
  std::uint64_t size;
  std::uint64_t checksum;
};

std::uint64_t fnv1a(const std::uint8_t* data, std::size_t size) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ data[i]) * 1099511628211ULL;
  return hash;
}

std::filesystem::path file_of(const vk::PhysicalDeviceProperties& device, const std::filesystem::path& folder) {
  if (folder.empty()) return {};
  return folder / fmt::format("{:04x}-{:04x}-{:08x}-{:016x}.pipelines", device.vendorID, device.deviceID, device.driverVersion,
                              fnv1a(device.pipelineCacheUUID.data(), device.pipelineCacheUUID.size()));
}

bool made_by(const vk::PhysicalDeviceProperties& device, const std::vector<std::uint8_t>& payload) {
  VkPipelineCacheHeaderVersionOne header;
  if (payload.size() < sizeof header) return false;
  std::memcpy(&header, payload.data(), sizeof header);
  return header.headerSize >= sizeof header && header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE &&
         header.vendorID == device.vendorID && header.deviceID == device.deviceID &&
         std::equal(device.pipelineCacheUUID.begin(), device.pipelineCacheUUID.end(), header.pipelineCacheUUID);
}

std::vector<std::uint8_t> read(const std::filesystem::path& file, const vk::PhysicalDeviceProperties& device) {
  if (file.empty()) return {};
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  auto payload = unwrap_cache({std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()});
  if (!made_by(device, payload)) payload.clear();
  return payload;
}

vk::raii::PipelineCache open(const Device& device, const std::filesystem::path& file) {
  const auto payload = read(file, device.physical().getProperties());
  return vk::raii::PipelineCache(device.handle(), vk::PipelineCacheCreateInfo({}, payload.size(), payload.data()));
}

/// A name no other writer uses, in this process or another.
std::filesystem::path beside(const std::filesystem::path& file) {
  std::random_device random;
  std::filesystem::path path = file;
  path += fmt::format(".{:08x}{:08x}.tmp", random(), random());
  return path;
}

}  // namespace

std::vector<std::uint8_t> wrap_cache(const std::vector<std::uint8_t>& payload) {
  Header header;
  std::copy(std::begin(kMagic), std::end(kMagic), header.magic);
  header.size = payload.size();
  header.checksum = fnv1a(payload.data(), payload.size());
  std::vector<std::uint8_t> file(sizeof header + payload.size());
  std::memcpy(file.data(), &header, sizeof header);
  std::copy(payload.begin(), payload.end(), file.begin() + sizeof header);
  return file;
}

std::vector<std::uint8_t> unwrap_cache(const std::vector<std::uint8_t>& file) {
  Header header;
  if (file.size() < sizeof header) return {};
  std::memcpy(&header, file.data(), sizeof header);
  if (!std::equal(std::begin(kMagic), std::end(kMagic), header.magic) || header.size != file.size() - sizeof header) return {};
  if (header.checksum != fnv1a(file.data() + sizeof header, file.size() - sizeof header)) return {};
  return {file.begin() + sizeof header, file.end()};
}

PipelineCache::PipelineCache(const Device& device, const std::filesystem::path& folder)
    : file_(file_of(device.physical().getProperties(), folder)), cache_(open(device, file_)) {}

void PipelineCache::save() const noexcept try {
  if (file_.empty()) return;
  const std::vector<std::uint8_t> file = wrap_cache(cache_.getData());
  std::error_code error;
  std::filesystem::create_directories(file_.parent_path(), error);
  const std::filesystem::path draft = beside(file_);
  {
    std::ofstream out(draft, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
    if (!out.flush()) error = std::make_error_code(std::errc::io_error);
  }
  if (!error) std::filesystem::rename(draft, file_, error);
  if (error) std::filesystem::remove(draft, error);
} catch (...) {
}

}  // namespace swarmfit::kernels::vulkan
